// The bar of buttons above the surface.
#pragma once

#include <string>
#include <vector>

#include "viz/live/stats.h"
#include "viz/panels/actions/actions.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

struct BarButton {
  int rank;  ///< those of low numbers get the room of the bar
  const char* label;
  const char* longest;  ///< of the words that it has in turn, so that no button moves
  const Action* action;
  bool on = false;        ///< what it opens or starts is there
  bool last = false;      ///< at the right end of the bar
  bool in_bar = false;    ///< there is room for it
  std::string face = {};  ///< in the bar: icon and word, icon, or word
  float width = 0;        ///< px
};
/// Those of this input, in their order. The bar has the most wanted ones; the settings have the others.
std::vector<BarButton> bar_buttons(const Layout& layout, float scale, bool has_surface, const LiveStats* live,
                                   const ViewState& state);

void tool_bar(const Layout& layout, float scale, bool has_surface, const LiveStats* live, ViewState& state);

}  // namespace palpate::viz
