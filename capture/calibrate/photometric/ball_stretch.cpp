#include "capture/calibrate/photometric/ball_stretch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/calibrate/ball/finder.h"

namespace palpate {
namespace {

constexpr size_t kMost = 8;

cv::Mat stretched(const cv::Mat& plane, double factor) {
  cv::Mat out;
  cv::resize(plane, out, {plane.cols, static_cast<int>(std::lround(plane.rows * factor))});
  return out;
}

Frame stretched(const Frame& frame, double factor) {
  const FrameFormat& f = frame.format;
  const int width = static_cast<int>(f.width), height = static_cast<int>(f.height);
  Frame out;
  for (uint32_t c = 0; c < f.channels; ++c) {
    const cv::Mat plane = stretched(
        cv::Mat(height, width, f.bit_depth > 8 ? CV_16UC1 : CV_8UC1, const_cast<uint8_t*>(frame.row(c, 0))),
        factor);
    if (c == 0) out.reshape({f.width, static_cast<uint32_t>(plane.rows), f.channels, f.bit_depth});
    for (int y = 0; y < plane.rows; ++y)
      std::copy_n(plane.ptr(y), f.width * f.bytes_per_pixel(), out.row(c, static_cast<uint32_t>(y)));
  }
  return out;
}

/// The share of the change around a contact that no ball explains, in a picture of another height.
double unexplained(const BallPress& press, const Frame& background, const Sensor& sensor, double factor) {
  const FrameFormat& f = press.frame.format;
  std::vector<uint8_t> mask;
  if (!press.mask.empty()) {
    const cv::Mat plane = stretched(cv::Mat(static_cast<int>(f.height), static_cast<int>(f.width), CV_8UC1,
                                            const_cast<uint8_t*>(press.mask.data())) != 0,
                                    factor);
    mask.assign(plane.begin<uint8_t>(), plane.end<uint8_t>());
  }
  // The ball may be as large as it likes: a stretched contact is wider.
  const BallSearch search{PressedShape::ball(2 * press.shape.radius_mm), sensor.pitch_mm_per_px,
                          sensor.threshold_gray, 0.5};
  return 1 - find_ball(stretched(press.frame, factor), stretched(background, factor), mask, search).explained;
}

}  // namespace

BallStretch stretch_of(const BallPresses& found, const Sensor& sensor) {
  constexpr std::array<double, 2> kFactors{0.75, 4.0 / 3};
  std::vector<size_t> balls;
  for (size_t i = 0; i < found.presses.size(); ++i)
    if (found.presses[i].shape.kind == PressedShape::Kind::Ball) balls.push_back(i);
  if (found.format.channels != 3 || balls.empty()) return {};
  std::array<std::vector<double>, kFactors.size()> stretched_by;
  const size_t count = std::min(kMost, balls.size());
  for (size_t i = 0; i < count; ++i) {
    const size_t at = balls[i * balls.size() / count];
    const auto left = [&](double factor) {
      return unexplained(found.presses[at], found.backgrounds[at], sensor, factor);
    };
    const double round = left(1);
    for (size_t k = 0; k < kFactors.size(); ++k)
      stretched_by[k].push_back(left(kFactors[k]) / std::max(round, 1e-6));
  }
  const std::array<double, 2> left{median_in_place(stretched_by[0]), median_in_place(stretched_by[1])};
  const size_t best = left[0] < left[1] ? 0 : 1;
  BallStretch stretch;
  stretch.left = left[best];
  if (stretch.evident()) stretch.factor = kFactors[best];
  return stretch;
}

}  // namespace palpate
