// The palette: every action and setting of the window, found by its name.
#pragma once

#include "viz/panels/actions/actions.h"
#include "viz/render/view_state.h"
#include "viz/render/window.h"

namespace palpate::viz {

/// Over the upper middle of the picture, while ViewState::palette; a click runs what it is on.
void palette_window(VkExtent2D extent, float scale, const Circumstances& now, ViewState& state);
/// Arrows go through what was found, Enter runs it, Escape closes the palette.
void palette_key(const KeyPress& press, const Circumstances& now, ViewState& state);

}  // namespace palpate::viz
