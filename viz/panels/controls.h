// Controls for every setting of the view by mouse.
#pragma once

#include "viz/live/stats.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// The settings: in the dock, or without one a title in the upper left corner of the surface.
void control_window(const Layout& layout, float scale, bool has_surface, const LiveStats* live,
                    ViewState& state);

}  // namespace palpate::viz
