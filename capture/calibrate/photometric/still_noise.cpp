#include "capture/calibrate/photometric/still_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace palpate {

void StillNoise::add(const Frame& frame) {
  if (last_) {
    const FrameFormat& format = frame.format;
    const double pixels = double(format.width) * format.height;
    for (uint32_t c = 0; c < 3; ++c) {
      double sum = 0, squares = 0;
      for (uint32_t y = 0; y < format.height; ++y)
        for (uint32_t x = 0; x < format.width; ++x) {
          const double change = double(frame.at(c, x, y)) - double(last_->at(c, x, y));
          sum += change;
          squares += change * change;
        }
      const double variance = (squares - sum * sum / pixels) / pixels / 2;
      // A frame that was delivered twice tells nothing.
      if (squares > 0) variances_[c].push_back(variance / std::pow(format.max_gray(), 2));
    }
  }
  last_ = frame;
}

std::array<double, 3> StillNoise::sd() const {
  std::array<double, 3> out{};
  for (size_t c = 0; c < 3; ++c) {
    std::vector<double> sorted = variances_[c];
    if (sorted.empty()) return {};
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::ranges::nth_element(sorted, middle);
    out[c] = std::sqrt(*middle);
  }
  return out;
}

}  // namespace palpate
