#include "engine/numeric/poisson_dct.h"

#include <fftw3.h>

#include <cmath>
#include <mutex>
#include <numbers>

#include "engine/numeric/fftw_planner.h"

namespace palpate {
namespace {

std::vector<double> eigenvalues(uint32_t n) {
  std::vector<double> values(n);
  for (uint32_t k = 0; k < n; ++k) values[k] = 2 - 2 * std::cos(std::numbers::pi * k / n);
  return values;
}

}  // namespace

PoissonDct::PoissonDct(uint32_t width, uint32_t height)
    : width_(width), height_(height), cos_x_(eigenvalues(width)), cos_y_(eigenvalues(height)) {
  const std::lock_guard lock(fftw_planner());
  work_ = fftw_alloc_real(size_t{width} * height);
  const int rows = static_cast<int>(height), cols = static_cast<int>(width);
  forward_ = fftw_plan_r2r_2d(rows, cols, work_, work_, FFTW_REDFT10, FFTW_REDFT10, FFTW_ESTIMATE);
  backward_ = fftw_plan_r2r_2d(rows, cols, work_, work_, FFTW_REDFT01, FFTW_REDFT01, FFTW_ESTIMATE);
}

PoissonDct::~PoissonDct() {
  const std::lock_guard lock(fftw_planner());
  fftw_destroy_plan(static_cast<fftw_plan>(forward_));
  fftw_destroy_plan(static_cast<fftw_plan>(backward_));
  fftw_free(work_);
}

double PoissonDct::operations(uint32_t width, uint32_t height) {
  const PoissonDct dct(width, height);
  double sum = 0;
  for (void* plan : {dct.forward_, dct.backward_}) {
    double additions = 0, products = 0, both = 0;
    fftw_flops(static_cast<fftw_plan>(plan), &additions, &products, &both);
    sum += additions + products + 2 * both;
  }
  return sum / (static_cast<double>(width) * height);
}

template <typename Real>
void PoissonDct::solve_as(const Real* right, Real* z, uint32_t pitch) {
  for (uint32_t y = 0; y < height_; ++y)
    for (uint32_t x = 0; x < width_; ++x)
      work_[size_t{y} * width_ + x] = static_cast<double>(right[size_t{y} * pitch + x]);
  fftw_execute(static_cast<fftw_plan>(forward_));
  // Forward and backward together multiply by 4 width height.
  const double norm = 1.0 / (4.0 * width_ * height_);
  for (uint32_t y = 0; y < height_; ++y)
    for (uint32_t x = 0; x < width_; ++x) work_[size_t{y} * width_ + x] *= norm / (cos_x_[x] + cos_y_[y]);
  work_[0] = 0;
  fftw_execute(static_cast<fftw_plan>(backward_));
  for (uint32_t y = 0; y < height_; ++y)
    for (uint32_t x = 0; x < width_; ++x)
      z[size_t{y} * pitch + x] = static_cast<Real>(work_[size_t{y} * width_ + x]);
}

void PoissonDct::solve(const float* right, float* z, uint32_t pitch) {
  solve_as(right, z, pitch);
}
void PoissonDct::solve(const double* right, double* z, uint32_t pitch) {
  solve_as(right, z, pitch);
}

}  // namespace palpate
