#include "capture/calibrate/frame/markers.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "engine/base/statistics.h"

namespace palpate {
namespace {

constexpr float kDarker = 0.15f;        // mean over the channels, fraction of what surrounds the dot
constexpr float kDarkerAlways = 0.04f;  // in every channel: a slope darkens some and lightens others
constexpr size_t kFewest = 8;
constexpr double kMostMarked = 1.0 / 3;
constexpr double kSmallDot_px = 6;  // dots below have a rim of one pixel, as in the markers stage
constexpr double kAlikeDots = 0.7;  // share of a pattern's dots that are like its median
constexpr double kApart = 0.25, kLarge = 0.5;

/// Parts of an image that are darker than what surrounds them; part 0 is the rest.
struct DarkParts {
  cv::Mat darkness;  // of each pixel: CV_32F
  cv::Mat labels, statistics, centres;

  bool is_dot(int part) const {
    constexpr int kSpeck_px = 6;  // fewer are dust or noise
    return part > 0 && statistics.at<int>(part, cv::CC_STAT_AREA) >= kSpeck_px;
  }
  std::vector<int> dots() const {
    std::vector<int> dots;
    for (int part = 1; part < statistics.rows; ++part)
      if (is_dot(part)) dots.push_back(part);
    return dots;
  }
  bool at_border(int part) const {
    const int* box = statistics.ptr<int>(part);
    return box[cv::CC_STAT_LEFT] == 0 || box[cv::CC_STAT_TOP] == 0 ||
           box[cv::CC_STAT_LEFT] + box[cv::CC_STAT_WIDTH] == labels.cols ||
           box[cv::CC_STAT_TOP] + box[cv::CC_STAT_HEIGHT] == labels.rows;
  }
};

DarkParts dark_parts(const Frame& frame, const Sensor& sensor) {
  const FrameFormat& f = frame.format;
  const int width = static_cast<int>(f.width), height = static_cast<int>(f.height);
  const double largest_px = sensor.skin ? 2 * sensor.skin->size_px : std::min(width, height) / 16.0;
  const int side = std::max(9, static_cast<int>(largest_px)) | 1;
  const cv::Mat shape = cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side});
  const int type = f.bit_depth > 8 ? CV_16UC1 : CV_8UC1;
  const float black = 10 * static_cast<float>(f.max_gray()) / 255;
  DarkParts parts;
  parts.darkness = cv::Mat(height, width, CV_32F, cv::Scalar(0));
  cv::Mat least(height, width, CV_32F, cv::Scalar(1));
  for (uint32_t c = 0; c < f.channels; ++c) {
    const cv::Mat plane(height, width, type, const_cast<uint8_t*>(frame.row(c, 0)));
    cv::Mat smooth, closed, ratio, above;
    plane.convertTo(smooth, CV_32F);
    cv::GaussianBlur(smooth, smooth, {3, 3}, 0.8);
    cv::morphologyEx(smooth, closed, cv::MORPH_CLOSE, shape);
    cv::add(closed, cv::Scalar(black), above);
    cv::divide(closed - smooth, above, ratio);
    parts.darkness += ratio / static_cast<double>(f.channels);
    cv::min(least, ratio, least);
  }
  const cv::Mat dark = (parts.darkness > kDarker) & (least > kDarkerAlways);
  cv::connectedComponentsWithStats(dark, parts.labels, parts.statistics, parts.centres);
  return parts;
}

// Diameter of each dot at half of its darkness.
std::vector<double> sizes_px(const DarkParts& parts, const std::vector<int>& dots) {
  std::vector<double> sizes;
  for (const int dot : dots) {
    const int* box = parts.statistics.ptr<int>(dot);
    const cv::Rect around(box[cv::CC_STAT_LEFT], box[cv::CC_STAT_TOP], box[cv::CC_STAT_WIDTH],
                          box[cv::CC_STAT_HEIGHT]);
    const cv::Mat own = parts.labels(around) == dot, darkness = parts.darkness(around);
    double darkest = 0;
    cv::minMaxLoc(darkness, nullptr, &darkest, nullptr, nullptr, own);
    sizes.push_back(2 * std::sqrt(cv::countNonZero(own & (darkness > darkest / 2)) / std::numbers::pi));
  }
  return sizes;
}

// Distance from each dot to the nearest other one.
std::vector<double> distances_px(const DarkParts& parts, const std::vector<int>& dots) {
  std::vector<double> distances;
  for (const int dot : dots) {
    double nearest = INFINITY;
    for (const int other : dots)
      if (other != dot)
        nearest = std::min(nearest, cv::norm(parts.centres.row(other) - parts.centres.row(dot)));
    distances.push_back(nearest);
  }
  return distances;
}

// Share of the values that lie within a fraction `by` of `usual`.
double share_near(const std::vector<double>& values, double usual, double by) {
  const auto near = [&](double value) { return std::abs(value - usual) <= by * usual; };
  return static_cast<double>(std::ranges::count_if(values, near)) / static_cast<double>(values.size());
}

}  // namespace

std::vector<uint8_t> find_markers(const Frame& frame, const Sensor& sensor) {
  const DarkParts parts = dark_parts(frame, sensor);
  const std::vector<int> dots = parts.dots();
  if (dots.size() < kFewest) return {};
  cv::Mat mask(parts.labels.size(), CV_8U);
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) mask.at<uint8_t>(y, x) = parts.is_dot(parts.labels.at<int>(y, x));
  const int rim = median(sizes_px(parts, dots)) < kSmallDot_px ? 1 : 2;
  cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * rim + 1, 2 * rim + 1}));
  if (cv::countNonZero(mask) > kMostMarked * static_cast<double>(mask.total())) return {};
  return {mask.begin<uint8_t>(), mask.end<uint8_t>()};
}

std::optional<SkinPattern> marker_pattern(const Frame& untouched, const Sensor& sensor) {
  const DarkParts parts = dark_parts(untouched, sensor);
  std::vector<int> dots = parts.dots();
  std::erase_if(dots, [&](int dot) { return parts.at_border(dot); });
  if (dots.size() < kFewest) return {};
  const std::vector<double> apart = distances_px(parts, dots), sizes = sizes_px(parts, dots);
  const SkinPattern pattern{.kind = SkinKind::Markers, .spacing_px = median(apart), .size_px = median(sizes)};
  if (share_near(apart, pattern.spacing_px, kApart) < kAlikeDots ||
      share_near(sizes, pattern.size_px, kLarge) < kAlikeDots)
    return {};
  return pattern;
}

std::vector<uint8_t> either(std::vector<uint8_t> a, const std::vector<uint8_t>& b) {
  if (a.empty()) return b;
  for (size_t i = 0; i < b.size(); ++i) a[i] = a[i] || b[i];
  return a;
}

}  // namespace palpate
