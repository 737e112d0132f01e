#include "capture/calibrate/markers.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {
constexpr float kDarker = 0.15f;        // mean over the channels, fraction of what surrounds the dot
constexpr float kDarkerAlways = 0.04f;  // in every channel: a slope darkens some and lightens others
constexpr int kFewest = 8;
constexpr double kMost = 1.0 / 3;
constexpr int kRim_px = 2;
}  // namespace

std::vector<uint8_t> find_markers(const Frame& frame, const Sensor& sensor) {
  const FrameFormat& f = frame.format;
  const int width = static_cast<int>(f.width), height = static_cast<int>(f.height);
  const double largest_px = sensor.skin ? 2 * sensor.skin->size_px : std::min(width, height) / 16.0;
  const int side = std::max(9, static_cast<int>(largest_px)) | 1;
  const cv::Mat shape = cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side});
  const int type = f.bit_depth > 8 ? CV_16UC1 : CV_8UC1;
  const float black = 10 * static_cast<float>(f.max_gray()) / 255;
  cv::Mat mean(height, width, CV_32F, cv::Scalar(0)), least(height, width, CV_32F, cv::Scalar(1));
  for (uint32_t c = 0; c < f.channels; ++c) {
    const cv::Mat plane(height, width, type, const_cast<uint8_t*>(frame.row(c, 0)));
    cv::Mat smooth, closed, ratio, above;
    plane.convertTo(smooth, CV_32F);
    cv::GaussianBlur(smooth, smooth, {3, 3}, 0.8);
    cv::morphologyEx(smooth, closed, cv::MORPH_CLOSE, shape);
    cv::add(closed, cv::Scalar(black), above);
    cv::divide(closed - smooth, above, ratio);
    mean += ratio / static_cast<double>(f.channels);
    cv::min(least, ratio, least);
  }
  cv::Mat dots = (mean > kDarker) & (least > kDarkerAlways), labels, statistics, centres;
  const int parts = cv::connectedComponentsWithStats(dots, labels, statistics, centres);
  constexpr int kSpeck_px = 6;  // fewer are dust or noise
  const auto area = [&](int label) { return statistics.at<int>(label, cv::CC_STAT_AREA); };
  int found = 0;
  for (int i = 1; i < parts; ++i) found += area(i) >= kSpeck_px;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (area(labels.at<int>(y, x)) < kSpeck_px) dots.at<uint8_t>(y, x) = 0;
  cv::dilate(dots, dots, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * kRim_px + 1, 2 * kRim_px + 1}));
  const int covered = cv::countNonZero(dots);
  if (found < kFewest || covered > kMost * width * height) return {};
  std::vector<uint8_t> mask(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      mask[static_cast<size_t>(y) * f.width + static_cast<size_t>(x)] = dots.at<uint8_t>(y, x) ? 1 : 0;
  return mask;
}

std::vector<uint8_t> either(std::vector<uint8_t> a, const std::vector<uint8_t>& b) {
  if (a.empty()) return b;
  for (size_t i = 0; i < b.size(); ++i) a[i] = a[i] || b[i];
  return a;
}

}  // namespace palpate
