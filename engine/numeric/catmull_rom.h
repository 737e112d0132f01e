// Catmull-Rom: weights of four neighbours of a place between the middle two.
#pragma once

#include <array>

#include "engine/base/simd.h"

namespace palpate {

/// `t`: from the second neighbour on, 0 to 1. Exact for squares, and without the blur of straight lines.
template <typename Real>
PALPATE_INLINE std::array<Real, 4> catmull_rom(Real t) {
  constexpr Real kHalf = Real(0.5);
  return {t * (-kHalf + t * (1 - kHalf * t)), 1 + t * t * (Real(-2.5) + Real(1.5) * t),
          t * (kHalf + t * (2 - Real(1.5) * t)), t * t * (-kHalf + kHalf * t)};
}
/// Their derivatives by `t`.
template <typename Real>
PALPATE_INLINE std::array<Real, 4> catmull_rom_rates(Real t) {
  constexpr Real kHalf = Real(0.5);
  return {-kHalf + t * (2 - Real(1.5) * t), t * (-5 + Real(4.5) * t), kHalf + t * (4 - Real(4.5) * t),
          t * (-1 + Real(1.5) * t)};
}

}  // namespace palpate
