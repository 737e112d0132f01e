// Controls for every setting of the view by mouse, and the help that lists the keys.
#pragma once

#include <vector>

#include "viz/live/stats.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// One line of the help.
struct KeyHelp {
  const char* keys;
  const char* what;
  enum class Where { Always, NotInReplay, InReplay, WithSurface } where = Where::Always;
};
/// All keys and mouse movements of the view, in the order of the help.
const std::vector<KeyHelp>& key_help();
/// Those that do something with this input.
std::vector<KeyHelp> key_help(bool player, bool has_surface);

/// The settings: in the dock, or without one a title in the upper left corner of the surface.
void control_window(const Layout& layout, float scale, bool has_surface, const LiveStats* live,
                    ViewState& state);
/// The help over the middle of the whole picture; `open` becomes false where the person closes it.
void help_window(VkExtent2D extent, float scale, const std::vector<KeyHelp>& lines, bool& open);
/// The text of an event is done: the event is marked with it, or it is forgotten.
void end_labelling(ViewState& state, bool mark);
/// Where the text of an event is typed.
void label_window(const ViewRect& around, float scale, ViewState& state);

}  // namespace palpate::viz
