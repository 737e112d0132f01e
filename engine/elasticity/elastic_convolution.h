// Deflection by pressure as it is defined: the convolution with the pad's answer, zero-padded, by FFTW in
// double precision on the CPU. The reference of the reading `elastic`, and a choice.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/elasticity/elastic_kernel.h"

namespace palpate {

/// Plans and memory are made once; not thread safe.
class ElasticConvolution {
 public:
  ElasticConvolution(const ElasticKernel& kernel, uint32_t width, uint32_t height);
  ~ElasticConvolution();
  ElasticConvolution(const ElasticConvolution&) = delete;
  ElasticConvolution& operator=(const ElasticConvolution&) = delete;

  /// Deflection, mm, by pressure, MPa: height x width each, rows `pitch` and `out_pitch` elements apart.
  /// Outside the frame nothing presses.
  void solve(const float* pressure, uint32_t pitch, float* deflection, uint32_t out_pitch);
  void solve(const double* pressure, uint32_t pitch, double* deflection, uint32_t out_pitch);

 private:
  template <typename Real>
  void solve_as(const Real* pressure, uint32_t pitch, Real* deflection, uint32_t out_pitch);

  uint32_t width_, height_, padded_width_, padded_height_;
  double* work_ = nullptr;  ///< padded_height x (padded_width + 2)
  void* forward_ = nullptr;
  void* backward_ = nullptr;
  std::vector<double>
      answer_;  ///< spectrum of the pad's answer: real, since the answer is even, with the transforms' factor
};

/// The least number from n on whose only prime factors are 2, 3, 5 and 7, and which is even.
uint32_t next_good_size(uint32_t n);

}  // namespace palpate
