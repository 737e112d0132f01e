// Colour maps of the surface and the quantities that they show.
#pragma once

#include <array>

#include "shaders/shared/colormap.h"

namespace palpate::viz {

enum class ColourMap : int {
  Viridis = PALPATE_MAP_VIRIDIS,
  Cividis = PALPATE_MAP_CIVIDIS,
  Magma = PALPATE_MAP_MAGMA,
};
inline constexpr int kColourMaps = 3;
const char* to_string(ColourMap map);

/// Quantity shown by the colours of the surface.
enum class Quantity : int {
  Depth = PALPATE_SHOWN_DEPTH,        ///< below the rest level, mm
  Pressure = PALPATE_SHOWN_PRESSURE,  ///< of the contact, MPa; by the sensor's gray or its layer
  /// Area of a piece of skin over its area at rest, less 1, by the surface's slope: sqrt(1 + slope^2) - 1.
  /// That is the skin's stretch if every point of it has moved straight down; what it moves along itself is
  /// not in it.
  Strain = PALPATE_SHOWN_STRAIN,
  Friction = PALPATE_SHOWN_FRICTION,  ///< shear over pressure, by the layer (Output::Traction with a skin)
};
inline constexpr int kQuantities = 4;
const char* to_string(Quantity quantity);

/// Red, green, blue, display encoded, 0 to 1; t is clamped to 0 (rest) to 1 (end of the range).
std::array<float, 3> colour_of(ColourMap map, double t);

}  // namespace palpate::viz
