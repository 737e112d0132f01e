// How the program runs: rates, drops, latency, mesh and device, over a timeline of the last pictures.
#pragma once

#include "viz/panels/hud_content.h"
#include "viz/render/layout.h"

namespace palpate::viz {

/// Over the surface, at its lower left; the mouse goes through it. `content` is of a live session.
void performance_overlay(const Layout& layout, const HudContent& content, float scale);

}  // namespace palpate::viz
