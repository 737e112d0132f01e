#include "engine/numeric/transform/cosine_transform.h"

#include <cmath>
#include <numbers>

#include "engine/base/simd.h"

namespace palpate {
namespace {

/// Both work on the pair of waves k and size - k. Two lines a and b share a lane as a + i b; the spectrum of
/// a is the even part of what they have in common, that of b the odd one.
struct FromWaves {
  LaneRow* z;
  const double* turns;
  uint32_t size;

  PALPATE_INLINE void run() const {
    for (uint32_t lane = 0; lane < 2 * kLaneCount; ++lane) z[0].values[lane] *= 2;
    for (uint32_t k = 1; 2 * k < size; ++k) {
      LaneRow &low = z[k], &high = z[size - k];
      const double cos = turns[2 * k], sin = turns[2 * k + 1];
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        const double a_re = low.re()[lane] + high.re()[lane], a_im = low.im()[lane] - high.im()[lane];
        const double b_re = low.im()[lane] + high.im()[lane], b_im = high.re()[lane] - low.re()[lane];
        low.re()[lane] = cos * a_re + sin * a_im;
        high.re()[lane] = sin * a_re - cos * a_im;
        low.im()[lane] = cos * b_re + sin * b_im;
        high.im()[lane] = sin * b_re - cos * b_im;
      }
    }
    if (size % 2 == 0)
      for (double& value : z[size / 2].values) value *= std::numbers::sqrt2;
  }
};

struct ToWaves {
  LaneRow* z;
  const double* turns;
  uint32_t size;

  PALPATE_INLINE void run() const {
    for (uint32_t k = 1; 2 * k < size; ++k) {
      LaneRow &low = z[k], &high = z[size - k];
      const double cos = turns[2 * k], sin = turns[2 * k + 1];
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        const double a_re = cos * low.re()[lane] + sin * high.re()[lane];
        const double a_im = sin * low.re()[lane] - cos * high.re()[lane];
        const double b_re = cos * low.im()[lane] + sin * high.im()[lane];
        const double b_im = sin * low.im()[lane] - cos * high.im()[lane];
        low.re()[lane] = a_re - b_im;
        high.re()[lane] = a_re + b_im;
        low.im()[lane] = a_im + b_re;
        high.im()[lane] = b_re - a_im;
      }
    }
    if (size % 2 == 0)
      for (double& value : z[size / 2].values) value *= std::numbers::sqrt2;
  }
};

}  // namespace

// J. Makhoul, IEEE Trans. Acoust. Speech Signal Process. 28 (1980) 27: elements of even number in order, then
// those of odd number from the last one; the cosine transform is the real part of their spectrum, turned.
CosineTransform::CosineTransform(uint32_t size) : fft_(size) {
  for (uint32_t k = 0; 2 * k <= size; ++k) {
    const double angle = std::numbers::pi * k / (2.0 * size);
    turns_.push_back(std::cos(angle));
    turns_.push_back(std::sin(angle));
  }
}

LaneRow* CosineTransform::forward(LaneRow* data, LaneRow* scratch) const {
  LaneRow* waves = fft_.forward(data, scratch);
  run_widest(FromWaves{waves, turns_.data(), fft_.size()});
  return waves;
}

LaneRow* CosineTransform::backward(LaneRow* data, LaneRow* scratch) const {
  run_widest(ToWaves{data, turns_.data(), fft_.size()});
  return fft_.backward(data, scratch);
}

}  // namespace palpate
