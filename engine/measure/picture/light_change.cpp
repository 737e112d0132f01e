#include "engine/measure/picture/light_change.h"

#include <algorithm>
#include <cmath>

#include "engine/base/statistics.h"

namespace palpate {
namespace {

constexpr float kDark_gray = 4;  // a gain shows too little below

bool follows(const LightChange& light, float change, float untouched) {
  return std::abs(double{change} - light.at(double{untouched})) < LightEstimate::kInlier_gray;
}

/// The line through what follows `light`, by least squares.
LightChange line_through(const LightChange& light, std::span<const float> change,
                         std::span<const float> untouched) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (size_t i = 0; i < change.size(); ++i) {
    if (!follows(light, change[i], untouched[i])) continue;
    const double u = untouched[i], c = change[i];
    n += 1, x += u, y += c, xx += u * u, xy += u * c;
  }
  if (n < 2) return light;
  const double spread = xx - x * x / n;
  const double slope = spread > n ? (xy - x * y / n) / spread : 0;
  return {.gain = 1 + slope, .offset_gray = (y - slope * x) / n};
}

}  // namespace

LightChange LightEstimate::find(std::span<const float> change, std::span<const float> untouched) {
  const size_t count = change.size();
  sorted_.assign(change.begin(), change.end());
  const LightChange shifted{.offset_gray = double{median_in_place(sorted_)}};
  for (size_t i = 0; i < count; ++i) sorted_[i] = change[i] / std::max(untouched[i], kDark_gray);
  const LightChange scaled{.gain = 1 + double{median_in_place(sorted_)}};
  const auto followers = [&](const LightChange& light) {
    size_t n = 0;
    for (size_t i = 0; i < count; ++i) n += follows(light, change[i], untouched[i]);
    return n;
  };
  const size_t by_shift = followers(shifted), by_scale = followers(scaled);
  // A gain has to be seen: it explains a tenth of the places more.
  LightChange light = by_scale > by_shift + count / 10 ? scaled : shifted;
  const double share = static_cast<double>(std::max(by_shift, by_scale)) / static_cast<double>(count);
  light.known = share >= kFewInliers;
  if (light.known)
    for (int pass = 0; pass < 3; ++pass) light = line_through(light, change, untouched);
  light.share = share;
  return light;
}

bool LightTrust::enough(double share) {
  matched_ = matched_ || share >= kSureInliers;
  return share >= (matched_ ? LightEstimate::kFewInliers : kSureInliers);
}

}  // namespace palpate
