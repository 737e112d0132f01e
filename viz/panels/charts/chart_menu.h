// The menu of the strip charts.
#pragma once

#include <functional>
#include <string>

#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// Where it was opened: saves and copies (`table` gives the CSV), or shows all of the time. Closes by a
/// choice or a click elsewhere.
void chart_menu(const ViewRect& charts, float scale, const std::function<std::string()>& table,
                ViewState& state);

}  // namespace palpate::viz
