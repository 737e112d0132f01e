#include "viz/render/colour_map.h"

#include <algorithm>

namespace palpate::viz {

const char* to_string(ColourMap map) {
  switch (map) {
    case ColourMap::Cividis:
      return "cividis";
    case ColourMap::Magma:
      return "magma";
    default:
      return "viridis";
  }
}

const char* to_string(Quantity quantity) {
  switch (quantity) {
    case Quantity::Pressure:
      return "pressure";
    case Quantity::Strain:
      return "strain";
    case Quantity::Friction:
      return "shear / pressure";
    default:
      return "depth";
  }
}

std::array<float, 3> colour_of(ColourMap map, double t) {
  const auto v = static_cast<float>(std::clamp(t, 0.0, 1.0));
  const auto within = [](float x) { return std::clamp(x, 0.0f, 1.0f); };
  const int index = static_cast<int>(map);
  return {within(map_red(index, v)), within(map_green(index, v)), within(map_blue(index, v))};
}

}  // namespace palpate::viz
