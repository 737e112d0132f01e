// The menu of the strip charts.
#pragma once

#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// Where it was opened: saves and copies, or shows all of the time. Closes by a choice or a click elsewhere.
void chart_menu(const ViewRect& charts, float scale, ViewState& state);

}  // namespace palpate::viz
