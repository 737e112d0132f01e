// Letters, figures and icons of the window.
#pragma once

#include <string>
#include <string_view>

struct ImFont;
struct ImFontAtlas;

namespace palpate::viz {

struct Fonts {
  ImFont* body = nullptr;  ///< with the icons, where their font is installed
  ImFont* small = nullptr;
  ImFont* large = nullptr;  ///< of headlines
};

/// Adds the first installed of Inter and DejaVu, else ImGui's own. `scale`: of all sizes, 1 for 96 dpi.
Fonts add_fonts(ImFontAtlas& atlas, float scale);
/// Gives all digits of a built atlas one width, so that numbers stand still while they change.
void make_figures_tabular(ImFontAtlas& atlas);

/// The icon of an action, by the word of its button (what follows ## does not count), in UTF-8; empty where
/// the present font has none.
std::string icon_of(std::string_view word);

}  // namespace palpate::viz
