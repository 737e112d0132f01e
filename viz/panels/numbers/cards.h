// Cards: groups of numbers, one below the other, as close as their room needs.
#pragma once

#include <imgui.h>

#include <functional>
#include <string>
#include <vector>

#include "viz/look/theme.h"
#include "viz/render/hud_frame.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

/// A label, and what it is. Without a label the words begin at the left and may take several lines.
struct CardRow {
  std::string label, words;
  Meaning meaning = Meaning::Plain;
};
using CardRows = std::vector<CardRow>;

struct Card {
  std::string title;
  std::string aside = {};  ///< at the right end of the title
  CardRows rows = {};
  float above_px = 0;   ///< height of a drawing over the rows, at scale 1
  float beside_px = 0;  ///< side of a square drawing at their left, at scale 1
  std::function<void(ImVec2 low, ImVec2 high)> draw = {};  ///< that drawing, in its rectangle
};

/// ImGui's window in a rectangle of the picture, for cards; without a ground of its own.
void begin_panel(const char* name, const ViewRect& rect, float scale);

/// Draws cards from the cursor to the foot of ImGui's present window, as wide as it is. Where they have no
/// room they move together, then take the small letters; what even then has none is scrolled to.
void draw_cards(const HudFrame& frame, const std::vector<Card>& cards);

}  // namespace palpate::viz
