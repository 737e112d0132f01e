// Surfaces that are known exactly, and the error of a height map against one.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "perf/profile/sizes.h"

namespace palpate::perf {

struct Truth {
  std::string name;
  std::vector<double> height;    ///< height x width, px
  std::vector<float> gradients;  ///< height x width x 2
};

/// smooth (a Gaussian), wide (half a cosine across the frame), tilted (a plane), capped (a ball's rim) and
/// noisy (the Gaussian with errors on its slopes, 2 % of the steepest).
std::vector<Truth> make_truths(const FrameSize& size);

struct SurfaceErrors {
  double relative_rms = 0;    ///< RMS error over RMS of the truth, both about their means
  double peak_to_valley = 0;  ///< relative
};

/// `at(x, y)` is the height found, up to a constant.
SurfaceErrors errors_of(const Truth& truth, const FrameSize& size,
                        const std::function<double(uint32_t, uint32_t)>& at);

/// The paper's surface (Eq. 61-63): slopes summed along the first row and from there down each column, by
/// trapezoids. `gradients` is height x width x 2, z height x width.
void line_integral(const float* gradients, uint32_t width, uint32_t height, float* z);

}  // namespace palpate::perf
