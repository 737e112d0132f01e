// Deflection by pressure as it is defined: the convolution with the pad's answer, zero-padded, in double
// precision on the CPU. The reference of the reading `elastic`, and a choice.
#pragma once

#include <cstdint>

#include "engine/numeric/transform/convolution.h"
#include "engine/pad/elastic_kernel.h"

namespace palpate {

/// Plans and memory are made once; not thread safe.
class ElasticConvolution {
 public:
  ElasticConvolution(const ElasticKernel& kernel, uint32_t width, uint32_t height);

  /// Deflection, mm, by pressure, MPa: height x width each, rows `pitch` and `out_pitch` elements apart.
  /// Outside the frame nothing presses.
  void solve(const float* pressure, uint32_t pitch, float* deflection, uint32_t out_pitch);
  void solve(const double* pressure, uint32_t pitch, double* deflection, uint32_t out_pitch);

 private:
  template <typename Real>
  void solve_as(const Real* pressure, uint32_t pitch, Real* deflection, uint32_t out_pitch);

  Convolution convolution_;
  Convolution::Kernel answer_;
};

}  // namespace palpate
