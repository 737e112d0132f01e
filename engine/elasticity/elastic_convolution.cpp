#include "engine/elasticity/elastic_convolution.h"

#include <fftw3.h>

#include <algorithm>
#include <mutex>

#include "engine/numeric/fftw_planner.h"

namespace palpate {

uint32_t next_good_size(uint32_t n) {
  for (uint32_t size = std::max(n + n % 2, 2u);; size += 2) {
    uint32_t rest = size;
    for (const uint32_t prime : {2u, 3u, 5u, 7u})
      while (rest % prime == 0) rest /= prime;
    if (rest == 1) return size;
  }
}

ElasticConvolution::ElasticConvolution(const ElasticKernel& kernel, uint32_t width, uint32_t height)
    : width_(width),
      height_(height),
      // Twice the frame less one: no answer reaches a pixel around the transform's edge.
      padded_width_(next_good_size(2 * width - 1)),
      padded_height_(next_good_size(2 * height - 1)) {
  const size_t pitch = size_t{padded_width_} + 2;
  const std::lock_guard lock(fftw_planner());
  work_ = fftw_alloc_real(pitch * padded_height_);
  const int rows = static_cast<int>(padded_height_), cols = static_cast<int>(padded_width_);
  auto* spectrum = reinterpret_cast<fftw_complex*>(work_);
  forward_ = fftw_plan_dft_r2c_2d(rows, cols, work_, spectrum, FFTW_ESTIMATE);
  backward_ = fftw_plan_dft_c2r_2d(rows, cols, spectrum, work_, FFTW_ESTIMATE);

  std::fill_n(work_, pitch * padded_height_, 0.0);
  for (uint32_t y = 0; y < height; ++y) {
    for (uint32_t x = 0; x < width; ++x) {
      const double answer = kernel.at(x, y);
      for (const uint32_t row : {y, (padded_height_ - y) % padded_height_})
        for (const uint32_t column : {x, (padded_width_ - x) % padded_width_})
          work_[row * pitch + column] = answer;
    }
  }
  fftw_execute(static_cast<fftw_plan>(forward_));
  const double norm = 1 / static_cast<double>(size_t{padded_width_} * padded_height_);
  answer_.resize(pitch / 2 * padded_height_);
  for (size_t i = 0; i < answer_.size(); ++i) answer_[i] = work_[2 * i] * norm;
}

ElasticConvolution::~ElasticConvolution() {
  const std::lock_guard lock(fftw_planner());
  fftw_destroy_plan(static_cast<fftw_plan>(forward_));
  fftw_destroy_plan(static_cast<fftw_plan>(backward_));
  fftw_free(work_);
}

template <typename Real>
void ElasticConvolution::solve_as(const Real* pressure, uint32_t pitch, Real* deflection,
                                  uint32_t out_pitch) {
  const size_t work_pitch = size_t{padded_width_} + 2;
  std::fill_n(work_, work_pitch * padded_height_, 0.0);
  for (uint32_t y = 0; y < height_; ++y)
    for (uint32_t x = 0; x < width_; ++x)
      work_[y * work_pitch + x] = static_cast<double>(pressure[size_t{y} * pitch + x]);
  fftw_execute(static_cast<fftw_plan>(forward_));
  for (size_t i = 0; i < answer_.size(); ++i) {
    work_[2 * i] *= answer_[i];
    work_[2 * i + 1] *= answer_[i];
  }
  fftw_execute(static_cast<fftw_plan>(backward_));
  for (uint32_t y = 0; y < height_; ++y)
    for (uint32_t x = 0; x < width_; ++x)
      deflection[size_t{y} * out_pitch + x] = static_cast<Real>(work_[y * work_pitch + x]);
}

void ElasticConvolution::solve(const float* pressure, uint32_t pitch, float* deflection, uint32_t out_pitch) {
  solve_as(pressure, pitch, deflection, out_pitch);
}
void ElasticConvolution::solve(const double* pressure, uint32_t pitch, double* deflection,
                               uint32_t out_pitch) {
  solve_as(pressure, pitch, deflection, out_pitch);
}

}  // namespace palpate
