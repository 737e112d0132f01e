// Points of the skin's pattern followed by OpenCV.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "palpate/frame.h"

namespace palpate::perf {

/// cv::calcOpticalFlowPyrLK from the untouched image to each frame, started where the last one ended; windows
/// of `side_px`, two levels, at most 20 iterations. Gray or the three planes' mean.
class OpenCvSkin {
 public:
  OpenCvSkin(const Frame& untouched, const std::vector<std::array<float, 2>>& points, int side_px);
  ~OpenCvSkin();
  /// Where the points are now, px; NaN where it lost them.
  const std::vector<std::array<float, 2>>& follow(const Frame& frame);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::perf
