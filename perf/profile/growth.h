// Growth of a time with the frame: exponent of the number of pixels, by a straight line through the
// logarithms.
#pragma once

#include <span>

#include "perf/profile/profile.h"

namespace palpate::perf {

struct PowerFit {
  double exponent = 0;
  double standard_error = 0;  ///< 0 for two points: a line through them has no scatter
  double constant = 0;        ///< value at x = 1
};

/// Least squares of log y over log x. Throws std::invalid_argument for fewer than two different x, or values
/// that are not positive.
PowerFit fit_power(std::span<const double> x, std::span<const double> y);

/// From this size on the fixed costs of a frame no longer rule its time.
inline constexpr uint64_t kLargeFrame_px = 640 * 480;

/// For each reading the whole frame ("frame") and each stage: over all sizes, and over frames of at least
/// kLargeFrame_px where there are three of them.
std::vector<Growth> growth_of(const std::vector<SizeFigure>& sizes);

}  // namespace palpate::perf
