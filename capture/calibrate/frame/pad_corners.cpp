#include "capture/calibrate/frame/pad_corners.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace palpate {
namespace {

constexpr double kMostShare = 0.9, kLeastShare = 0.1;
constexpr double kDarkOutside = 0.3, kFilled = 0.9;
constexpr double kDrawnIn = 0.02;

}  // namespace

std::array<uint32_t, 2> size_of(const std::array<std::array<double, 2>, 4>& q) {
  const auto side = [&](size_t a, size_t b) { return std::hypot(q[a][0] - q[b][0], q[a][1] - q[b][1]); };
  const double above = side(0, 1), below = side(3, 2), left = side(0, 3), right = side(1, 2);
  const double width = std::max(std::round(std::max(above, below)), 1.0);
  // Seen at a slant the nearer side is too long and the farther one too short: their mean keeps the shape.
  const double height = std::max(std::round(width * (left + right) / std::max(above + below, 1e-9)), 1.0);
  return {static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
}

std::optional<PadCorners> propose_corners(const Frame& untouched) {
  const FrameFormat& f = untouched.format;
  cv::Mat bright(static_cast<int>(f.height), static_cast<int>(f.width), CV_8UC1);
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      uint32_t most = 0;
      for (uint32_t c = 0; c < f.channels; ++c) most = std::max(most, untouched.at(c, x, y));
      bright.at<uint8_t>(static_cast<int>(y), static_cast<int>(x)) =
          static_cast<uint8_t>(most * 255 / f.max_gray());
    }
  cv::GaussianBlur(bright, bright, {9, 9}, 0);
  cv::Mat lit;
  cv::threshold(bright, lit, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
  cv::morphologyEx(lit, lit, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_ELLIPSE, {25, 25}));
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(lit, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
  if (outlines.empty()) return std::nullopt;
  const auto& largest =
      *std::ranges::max_element(outlines, {}, [](const auto& o) { return cv::contourArea(o); });
  std::vector<cv::Point> hull, quad;
  cv::convexHull(largest, hull);
  const double around = cv::arcLength(hull, true);
  for (double share = 0.01; share < 0.2; share += 0.005) {
    cv::approxPolyDP(hull, quad, share * around, true);
    if (quad.size() <= 4) break;
  }
  PadCorners found;
  found.share = cv::contourArea(hull) / (static_cast<double>(f.width) * f.height);
  cv::Mat region(bright.size(), CV_8UC1, cv::Scalar(0));
  cv::fillPoly(region, std::vector<std::vector<cv::Point>>{hull}, cv::Scalar(255));
  const double inside = cv::mean(bright, region)[0], outside = cv::mean(bright, ~region)[0];
  // Lamps that shine into a gel are no pad: what lies around a pad is dark, and a pad fills its corners.
  if (outside > kDarkOutside * inside || cv::contourArea(largest) < kFilled * cv::contourArea(quad))
    return std::nullopt;
  if (quad.size() != 4 || found.share > kMostShare || found.share < kLeastShare) return std::nullopt;
  // Top left first, then clockwise as the picture is seen.
  cv::Point2d middle(0, 0);
  for (const cv::Point& p : quad) middle += cv::Point2d(p) * 0.25;
  std::ranges::sort(quad, {}, [&](const cv::Point& p) { return std::atan2(p.y - middle.y, p.x - middle.x); });
  for (size_t i = 0; i < 4; ++i)
    found.quad_px[i] = {quad[i].x + kDrawnIn * (middle.x - quad[i].x),
                        quad[i].y + kDrawnIn * (middle.y - quad[i].y)};
  found.size_px = size_of(found.quad_px);
  return found;
}

}  // namespace palpate
