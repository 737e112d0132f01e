#include "capture/run/map/touched_depths.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace palpate {

/// A valley of an object's relief is touched, too; only what is nearly at rest is not.
void TouchedDepths::close(std::span<const float> depth_mm, float least_mm) {
  const double reach = kBetween_mm / pitch_mm_;
  cv::Mat contact(static_cast<int>(height_), static_cast<int>(width_), CV_8U, contact_.data()), far;
  // Distances are to the nearest pixel that is 0; without one nothing is near.
  if (cv::countNonZero(contact) == 0) return;
  cv::distanceTransform(contact == 0, far, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat(far <= reach).copyTo(contact);
  if (cv::countNonZero(contact) < static_cast<int>(contact_.size())) {
    cv::distanceTransform(contact, far, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    cv::Mat(far > reach).copyTo(contact);
  }
  for (size_t i = 0; i < contact_.size(); ++i)
    contact_[i] = contact_[i] != 0 && depth_mm[i] > least_mm ? 1 : 0;
}

HeightMap TouchedDepths::of(std::span<const float> depth_mm, bool touched, double depth_sd_mm) {
  contact_.assign(depth_mm.size(), 0);
  if (touched && !depth_mm.empty()) {
    sorted_.assign(depth_mm.begin(), depth_mm.end());
    // From the frame's own lowest places: where little of the pad is at rest, its level is not known.
    const auto fiftieth = static_cast<std::ptrdiff_t>(sorted_.size() / 50);
    const auto low = sorted_.begin() + fiftieth, deep = sorted_.end() - 1 - fiftieth;
    std::nth_element(sorted_.begin(), low, sorted_.end());
    std::nth_element(low, deep, sorted_.end());
    constexpr double kSure = 4, kLeast_mm = 0.01;  // clear of the depths' noise
    const double range = double{*deep} - double{*low};
    const auto level_of = [&](double share) {
      return static_cast<float>(double{*low} + std::max({share * range, kSure * depth_sd_mm, kLeast_mm}));
    };
    const float level = level_of(share_);
    std::ranges::transform(depth_mm, contact_.begin(),
                           [level](float depth) { return static_cast<uint8_t>(depth > level); });
    close(depth_mm, level_of(share_ / 2));
  }
  return {.width = width_,
          .height = height_,
          .pitch_mm_per_px = pitch_mm_,
          .depth_mm = depth_mm,
          .contact = contact_};
}

}  // namespace palpate
