// Banners at the foot and the head of the window: state of the session, warnings.
#pragma once

#include "viz/live/stats.h"
#include "viz/panels/hud_content.h"
#include "viz/render/layout.h"

namespace palpate::viz {

/// One line at the foot: the last note, what a camera lost, frame and time.
void status_line(const Layout& layout, const HudContent& content, float scale);
/// Urgent messages: that it records, that recording failed, that no frames come.
void banner(const Layout& layout, const LiveStats& live, float scale);

}  // namespace palpate::viz
