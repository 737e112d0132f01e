#include "engine/numeric/poisson_dct.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/simd.h"

namespace palpate {
namespace {

/// Eigenvalues of the second difference; a multiple of 16, those beyond n any number but 0.
std::vector<double> eigenvalues(uint32_t n) {
  std::vector<double> values(divide_up(n, LaneMap::kSide) * LaneMap::kSide, 1.0);
  for (uint32_t k = 0; k < n; ++k) values[k] = 2 - 2 * std::cos(std::numbers::pi * k / n);
  return values;
}

struct DivideByEigenvalues {
  LaneRow* waves;
  const double *of_x, *of_y;
  uint32_t count;
  double norm;

  PALPATE_INLINE void run() const {
    for (uint32_t x = 0; x < count; ++x)
      for (uint32_t lane = 0; lane < LaneMap::kSide; ++lane)
        waves[x].values[lane] *= norm / (of_x[x] + of_y[lane]);
  }
};

}  // namespace

PoissonDct::PoissonDct(uint32_t width, uint32_t height)
    : width_(width),
      height_(height),
      along_x_(width),
      along_y_(height),
      map_(width, height),
      data_(std::max(along_x_.rows(), along_y_.rows())),
      scratch_(data_.size()),
      cos_x_(eigenvalues(width)),
      cos_y_(eigenvalues(height)) {}

template <typename Real>
void PoissonDct::solve_as(const Real* right, Real* z, uint32_t pitch) {
  LaneRow *data = data_.data(), *scratch = scratch_.data();
  for (uint32_t block = 0; block < map_.column_blocks(); ++block) {
    const uint32_t left = block * LaneMap::kSide, count = std::min(LaneMap::kSide, width_ - left);
    for (uint32_t y = 0; y < height_; ++y) {
      LaneRow& row = data[along_y_.place(y)];
      row = {};
      for (uint32_t i = 0; i < count; ++i)
        row.values[i] = static_cast<double>(right[size_t{y} * pitch + left + i]);
    }
    std::copy_n(along_y_.forward(data, scratch), height_, map_.columns(block));
  }
  // Forward and backward together multiply by 4 width height.
  const double norm = 1.0 / (4.0 * width_ * height_);
  const auto place = [this](uint32_t x) { return along_x_.place(x); };
  for (uint32_t block = 0; block < map_.row_blocks(); ++block) {
    map_.read_rows(block, data, place);
    LaneRow* waves = along_x_.forward(data, scratch);
    run_widest(DivideByEigenvalues{waves, cos_x_.data(), cos_y_.data() + size_t{block} * LaneMap::kSide,
                                   width_, norm});
    if (block == 0) waves[0].values[0] = 0;
    map_.write_rows(block, along_x_.backward(waves, waves == data ? scratch : data), place);
  }
  for (uint32_t block = 0; block < map_.column_blocks(); ++block) {
    const uint32_t left = block * LaneMap::kSide, count = std::min(LaneMap::kSide, width_ - left);
    std::copy_n(map_.columns(block), height_, data);
    const LaneRow* heights = along_y_.backward(data, scratch);
    for (uint32_t y = 0; y < height_; ++y) {
      const LaneRow& row = heights[along_y_.place(y)];
      for (uint32_t i = 0; i < count; ++i) z[size_t{y} * pitch + left + i] = static_cast<Real>(row.values[i]);
    }
  }
}

void PoissonDct::solve(const float* right, float* z, uint32_t pitch) {
  solve_as(right, z, pitch);
}
void PoissonDct::solve(const double* right, double* z, uint32_t pitch) {
  solve_as(right, z, pitch);
}

}  // namespace palpate
