// Sum of gradients with OpenCV.
#pragma once

#include "palpate/frame.h"

namespace palpate::perf {

/// Frames of 8 bits and three channels, or one: differences in 16 bits, Sobel 5 x 5 across and down of each
/// plane, root of the sum of squares in single precision, less `limit` where it is more, summed. In gray
/// levels times px. One thread at a time.
class OpenCvGradient {
 public:
  explicit OpenCvGradient(const Frame& rest) : rest_(rest) {}
  double run(const Frame& frame, double limit_gray_per_px) const;

 private:
  Frame rest_;
};

}  // namespace palpate::perf
