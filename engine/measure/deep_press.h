// Deep presses: what the linear layer makes of the surface of rubber.
#pragma once

#include <span>

#include "engine/pad/traction.h"

namespace palpate {

/// A press as a frame shows it, lengths over the layer's thickness.
struct PressShape {
  double depth = 0;   ///< the largest
  double radius = 0;  ///< of the round contact whose pressure spreads as this one across its narrow side
  double round = 1;   ///< that spread over the one along it, 0 (a line) to 1
};
PressShape press_shape(std::span<const float> pressure, const TractionGrid& grid, double depth_mm,
                       double thickness_mm);

struct DeepPress {
  double factor = 1;       ///< the force over that which linear theory finds from the surface
  double relative_sd = 0;  ///< of the factor, by what depth and radius leave open: how flat the object is
};

inline constexpr double kDeepestPress = 2.0 / 3;  ///< of the thickness: no press was computed beyond

/// For a bonded layer of rubber, Poisson's ratio 0.48 to 0.49, and objects that slide on it; of presses
/// beyond kDeepestPress as at it.
DeepPress deep_press(const PressShape& press);

}  // namespace palpate
