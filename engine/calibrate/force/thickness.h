// A pad's thickness from presses with a gauge: wide contacts feel the window behind the pad, small ones do
// not.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "engine/calibrate/force/samples.h"

namespace palpate {

/// Thicknesses over the stated one at which the layer's force has to be known.
inline constexpr std::array kThicknesses{0.7, 1.0, 1.4};
using ThicknessForces = std::array<double, kThicknesses.size()>;  ///< N, by the layer, of one reading

struct ThicknessChoice {
  bool decided = false;    ///< false: the stated one stays, and the modulus alone is found
  double factor = 1;       ///< thickness over the stated one, by all recordings
  double relative_sd = 0;  ///< of `factor`: by objects left out (jackknife), and by errors of 2 % of each
  double error_N = 0;      ///< mean absolute error of objects left out, thickness and modulus by the others
  double stated_error_N = 0;  ///< likewise by the modulus alone
  size_t objects = 0;
  /// One line: what was found, or why the presses do not decide.
  std::string line() const;
};

/// Modulus and thickness together by least squares, each object counted alike, and judged by objects
/// left out one after the other. The thickness is decided where these are read better with it than by the
/// modulus alone by more than a standard error, a tenth of that error and 2 % of their force, by which linear
/// theory errs itself; its own error is below 15 %; and it does not lie at an end of kThicknesses. Fewer than
/// kFewestObjects decide nothing. `layer_N`: of each sample; what is not used, or not finite, does not
/// count. The depth's scale is not looked for: with linear theory it goes into the modulus.
ThicknessChoice choose_thickness(std::span<const ForceSample> samples,
                                 std::span<const ThicknessForces> layer_N);

}  // namespace palpate
