// The gradient stage in its plainest form: plain loops, one pixel at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "palpate/frame.h"
#include "shaders/shared/gradient.h"

namespace palpate::reference {

/// Sum over the frame of how much steeper the change is than `limit`, in 1/128 gray level per px; edges
/// repeated. `rest` null: the frame is the change.
inline uint64_t gradient_sum(const Frame& image, const Frame* rest, uint32_t limit) {
  constexpr int kSmooth[5] = {1, 4, 6, 4, 1}, kSlope[5] = {-1, -2, 0, 2, 1};
  const int width = static_cast<int>(image.format.width), height = static_cast<int>(image.format.height);
  uint64_t sum = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      uint64_t squares = 0;
      for (uint32_t channel = 0; channel < image.format.channels; ++channel) {
        int64_t across = 0, down = 0;
        for (int j = -2; j <= 2; ++j) {
          for (int i = -2; i <= 2; ++i) {
            const auto u = static_cast<uint32_t>(std::clamp(x + i, 0, width - 1)),
                       v = static_cast<uint32_t>(std::clamp(y + j, 0, height - 1));
            const int64_t d =
                int64_t{image.at(channel, u, v)} - (rest ? int64_t{rest->at(channel, u, v)} : int64_t{0});
            across += kSmooth[j + 2] * kSlope[i + 2] * d;
            down += kSlope[j + 2] * kSmooth[i + 2] * d;
          }
        }
        squares += static_cast<uint64_t>(across * across + down * down);
      }
      uint64_t root = 0;
      for (uint64_t bit = 1u << 16; bit > 0; bit /= 2)
        if ((root + bit) * (root + bit) <= squares) root += bit;
      sum += std::max<uint64_t>(root, limit) - limit;
    }
  }
  return sum;
}

}  // namespace palpate::reference
