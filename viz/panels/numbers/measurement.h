// The panel on the right: every number of the frame with unit, uncertainty and state, in cards.
#pragma once

#include "viz/panels/hud_content.h"
#include "viz/render/hud_frame.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// `shown`: the touch less the zero that `state` holds.
void measurement_panel(HudFrame& frame, const Layout& layout, const HudContent& content, const Touch& shown,
                       const ViewState& state);

}  // namespace palpate::viz
