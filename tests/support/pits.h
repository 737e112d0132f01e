// Traces of printed markers in a surface: fine structure under them against that around them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace palpate {

/// RMS of what a map's mean over a square of 2 * half + 1 px leaves, mm, about its own mean: a bend that is
/// the same everywhere is none.
struct Pits {
  double at_markers_mm = 0, elsewhere_mm = 0;
};

/// `markers`: 1 where one lies; `inside`: 1 for the pixels that count. The frame's margin, as wide as the
/// square reaches, does not.
inline Pits pits_of(const std::vector<float>& depth_mm, uint32_t width, const std::vector<uint8_t>& markers,
                    const std::vector<uint8_t>& inside, int half) {
  const int w = static_cast<int>(width), h = static_cast<int>(depth_mm.size()) / w;
  const auto at = [w](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x);
  };
  std::vector<double> sums(static_cast<size_t>(w + 1) * static_cast<size_t>(h + 1));
  const auto sum_at = [&](int x, int y) -> double& {
    return sums[static_cast<size_t>(y) * static_cast<size_t>(w + 1) + static_cast<size_t>(x)];
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      sum_at(x + 1, y + 1) = double{depth_mm[at(x, y)]} + sum_at(x, y + 1) + sum_at(x + 1, y) - sum_at(x, y);
  double sum[2]{}, squares[2]{}, count[2]{};
  const double side = 2 * half + 1;
  for (int y = half; y + half < h; ++y)
    for (int x = half; x + half < w; ++x) {
      if (!inside[at(x, y)]) continue;
      const double mean = (sum_at(x + half + 1, y + half + 1) - sum_at(x - half, y + half + 1) -
                           sum_at(x + half + 1, y - half) + sum_at(x - half, y - half)) /
                          (side * side);
      const double left = double{depth_mm[at(x, y)]} - mean;
      const size_t marked = markers[at(x, y)] ? 1 : 0;
      sum[marked] += left;
      squares[marked] += left * left;
      count[marked] += 1;
    }
  const double mean = (sum[0] + sum[1]) / std::max(count[0] + count[1], 1.0);
  const auto rms = [&](size_t k) {
    return std::sqrt(squares[k] / std::max(count[k], 1.0) -
                     mean * (2 * sum[k] / std::max(count[k], 1.0) - mean));
  };
  return {rms(1), rms(0)};
}

}  // namespace palpate
