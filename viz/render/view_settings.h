// Settings of the view that the window keeps from one run to the next, each described once: the window's
// file, its panel, its keys and its help take names, ranges, keys and sentences from here.
#pragma once

#include <span>
#include <variant>

#include "viz/render/colour_map.h"
#include "viz/render/image/strain_view.h"
#include "viz/render/layout.h"
#include "viz/render/section_line.h"

namespace palpate::viz {

/// What arrows over the surface show of the traction that the pad bears, where it is solved.
enum class TractionArrows : int { Shear, Pressure, Off };
inline constexpr int kTractionArrows = 3;
const char* to_string(TractionArrows arrows);

struct ViewSettings {
  static constexpr float kLeastTextScale = 0.6f, kMostTextScale = 4;

  float text_scale = 1;  ///< on top of the screen's own
  Quantity quantity = Quantity::Depth;
  ColourMap map = ColourMap::Viridis;
  TractionArrows arrows = TractionArrows::Shear;
  Arrangement arrangement = Arrangement::OneLarge;
  bool image_large = false;  ///< the large, first or only one of both
  bool lit = true, grid = true, axes = true, section = false;
  SectionLine line;
  bool charts = true;
  bool object_map = true;  ///< beside the pictures, where the motion of what touches is measured
  double chart_span_s = 10;
  bool contacts = true, skin = true;         ///< over the raw image
  SkinStrain skin_strain = SkinStrain::Off;  ///< over the raw image
  bool pixels = false;  ///< places in px from the top left corner, not mm from the middle
  bool rates = false, controls = false;
  bool light_theme = false;  ///< dark words on a light ground

  void enlarge_text(bool larger);
};

struct ViewSetting {
  using V = ViewSettings;
  using Member = std::variant<bool V::*, float V::*, double V::*, Quantity V::*, ColourMap V::*,
                              SkinStrain V::*, Arrangement V::*, TractionArrows V::*, SectionLine V::*>;
  const char* name;  ///< in the file, with its unit; of a box in the panel, with spaces
  Member member;
  const char* sentence = "";  ///< of the help and over its box
  int key = 0;  ///< GLFW_KEY_... that switches it, or goes on to its next value; letters are their codes
  bool on_surface = false;     ///< nothing without a surface that is drawn
  double least = 0, most = 0;  ///< of a number
};

/// All of them, in the order of the panel.
std::span<const ViewSetting> view_settings();
/// That of a key, which there must be.
const ViewSetting& view_setting(int key);

}  // namespace palpate::viz
