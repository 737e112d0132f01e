// The same least-squares surface by the discrete cosine transform on the CPU: the exact reference, and a
// choice.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/numeric/transform/cosine_transform.h"
#include "engine/numeric/transform/lane_map.h"

namespace palpate {

/// Solves A z = right for z of mean 0, where (A z)_i is the sum over the up to four neighbours j of (z_i -
/// z_j). The mean of `right` is ignored: no solution has one. Plans and memory are made once; not thread
/// safe.
class PoissonDct {
 public:
  PoissonDct(uint32_t width, uint32_t height);

  /// right and z are height x width, rows `pitch` elements apart; they may be the same memory.
  void solve(const float* right, float* z, uint32_t pitch);
  void solve(const double* right, double* z, uint32_t pitch);

 private:
  template <typename Real>
  void solve_as(const Real* right, Real* z, uint32_t pitch);

  uint32_t width_, height_;
  CosineTransform along_x_, along_y_;
  LaneMap map_;
  std::vector<LaneRow> data_, scratch_;
  std::vector<double> cos_x_, cos_y_;
};

}  // namespace palpate
