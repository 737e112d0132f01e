#include "capture/run/map/touched_depths.h"

#include <algorithm>

namespace palpate {
namespace {

/// Steps to the nearest pixel that is `to`, straight ways 1 and slanting ones sqrt(2); none is beyond the
/// picture.
void distances(const std::vector<uint8_t>& flags, uint8_t to, uint32_t width, std::vector<float>& out) {
  constexpr float kSlant = 1.41421356f, kNone = 1e9f;
  const auto w = static_cast<std::ptrdiff_t>(width), h = std::ssize(flags) / w;
  out.resize(flags.size());
  float* const at = out.data();
  const auto pass = [&](std::ptrdiff_t y, std::ptrdiff_t way, bool first) {
    const std::ptrdiff_t before = y - way;
    const bool inside = before >= 0 && before < h;
    for (std::ptrdiff_t k = 0; k < w; ++k) {
      const std::ptrdiff_t x = way > 0 ? k : w - 1 - k, i = y * w + x;
      float least = first ? (flags[static_cast<size_t>(i)] == to ? 0 : kNone) : at[i];
      if (k > 0) least = std::min(least, at[i - way] + 1);
      if (inside) {
        const float* above = at + before * w + x;
        least = std::min(least, above[0] + 1);
        if (x > 0) least = std::min(least, above[-1] + kSlant);
        if (x + 1 < w) least = std::min(least, above[1] + kSlant);
      }
      at[i] = least;
    }
  };
  for (std::ptrdiff_t y = 0; y < h; ++y) pass(y, 1, true);
  for (std::ptrdiff_t y = h; y-- > 0;) pass(y, -1, false);
}

}  // namespace

/// A valley of an object's relief is touched, too; only what is nearly at rest is not.
void TouchedDepths::close(std::span<const float> depth_mm, float least_mm) {
  const auto reach = static_cast<float>(kBetween_mm / pitch_mm_);
  distances(contact_, 1, width_, far_);
  std::ranges::transform(far_, contact_.begin(), [reach](float far) { return far <= reach ? 1 : 0; });
  distances(contact_, 0, width_, far_);
  for (size_t i = 0; i < contact_.size(); ++i)
    contact_[i] = far_[i] > reach && depth_mm[i] > least_mm ? 1 : 0;
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
