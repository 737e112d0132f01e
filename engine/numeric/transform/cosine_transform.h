// Discrete cosine transforms of sixteen real lines side by side, two in each lane of LaneFft.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/numeric/transform/lane_fft.h"

namespace palpate {

/// A plan; its calls may run in parallel. Both directions together multiply by 2 `size`.
class CosineTransform {
 public:
  /// `size` > 0.
  explicit CosineTransform(uint32_t size);

  /// Rows that `data` and `scratch` must hold each.
  uint32_t rows() const { return fft_.rows(); }
  /// Where the lines' element i belongs before forward(), and where backward() leaves it.
  uint32_t place(uint32_t i) const { return i % 2 == 0 ? i / 2 : fft_.size() - 1 - i / 2; }

  /// The second kind, X_k = 2 sum over i of x_i cos(pi k (i + 1/2) / size). Returns where X is, in order:
  /// `data` or `scratch`. The other one's contents are lost.
  LaneRow* forward(LaneRow* data, LaneRow* scratch) const;
  /// The third kind, x_i = X_0 + 2 sum over k > 0 of X_k cos(pi k (i + 1/2) / size), from X in order.
  LaneRow* backward(LaneRow* data, LaneRow* scratch) const;

 private:
  LaneFft fft_;
  std::vector<double> turns_;  ///< cos, sin of pi k / (2 size)
};

}  // namespace palpate
