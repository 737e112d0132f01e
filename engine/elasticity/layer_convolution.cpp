#include "engine/elasticity/layer_convolution.h"

#include <fftw3.h>

#include <algorithm>
#include <mutex>

#include "engine/elasticity/elastic_convolution.h"
#include "engine/numeric/fftw_planner.h"

namespace palpate {

LayerConvolution::LayerConvolution(const LayerKernel& kernel, uint32_t width, uint32_t height, bool shear)
    : width_(width),
      height_(height),
      padded_width_(next_good_size(2 * width - 1)),
      padded_height_(next_good_size(2 * height - 1)) {
  const size_t pitch = size_t{padded_width_} + 2, words = pitch * padded_height_;
  {
    const std::lock_guard lock(fftw_planner());
    work_ = fftw_alloc_real(words);
    const int rows = static_cast<int>(padded_height_), columns = static_cast<int>(padded_width_);
    auto* spectrum = reinterpret_cast<fftw_complex*>(work_);
    forward_ = fftw_plan_dft_r2c_2d(rows, columns, work_, spectrum, FFTW_ESTIMATE);
    backward_ = fftw_plan_dft_c2r_2d(rows, columns, spectrum, work_, FFTW_ESTIMATE);
  }
  const size_t parts = shear ? size_t{kParts} : 1;
  std::array<std::vector<double>, kParts> answers;
  for (size_t part = 0; part < parts; ++part) answers[part].assign(words, 0);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const CellAnswer at = kernel.at(x, y);
      const std::array<double, kParts> values = {at.depth,  at.x_by_pressure, at.y_by_pressure,
                                                 at.x_by_x, at.y_by_x,        at.y_by_y};
      // How each changes its sign from right to left and from below to above.
      constexpr std::array<std::array<int, 2>, kParts> kSigns = {
          {{1, 1}, {-1, 1}, {1, -1}, {1, 1}, {-1, -1}, {1, 1}}};
      for (const bool up : {false, true})
        for (const bool left : {false, true}) {
          if ((up && y == 0) || (left && x == 0)) continue;
          const size_t row = up ? padded_height_ - y : y, column = left ? padded_width_ - x : x;
          for (size_t part = 0; part < parts; ++part)
            answers[part][row * pitch + column] =
                values[part] * (left ? kSigns[part][0] : 1) * (up ? kSigns[part][1] : 1);
        }
    }
  const double norm = 1 / static_cast<double>(size_t{padded_width_} * padded_height_);
  for (size_t part = 0; part < parts; ++part) {
    std::copy(answers[part].begin(), answers[part].end(), work_);
    fftw_execute(static_cast<fftw_plan>(forward_));
    const auto* complex = reinterpret_cast<const std::complex<double>*>(work_);
    spectra_[part].assign(complex, complex + words / 2);
    for (std::complex<double>& value : spectra_[part]) value *= norm;
  }
  a_.resize(words / 2);
  b_.resize(words / 2);
}

LayerConvolution::~LayerConvolution() {
  const std::lock_guard lock(fftw_planner());
  fftw_destroy_plan(static_cast<fftw_plan>(forward_));
  fftw_destroy_plan(static_cast<fftw_plan>(backward_));
  fftw_free(work_);
}

const LayerConvolution::Spectrum& LayerConvolution::transform(const std::vector<double>& cells,
                                                              Spectrum& into) {
  const size_t pitch = size_t{padded_width_} + 2;
  std::fill_n(work_, pitch * padded_height_, 0.0);
  for (uint32_t y = 0; y < height_; ++y)
    std::copy_n(cells.begin() + static_cast<std::ptrdiff_t>(size_t{y} * width_), width_, work_ + y * pitch);
  fftw_execute(static_cast<fftw_plan>(forward_));
  const auto* complex = reinterpret_cast<const std::complex<double>*>(work_);
  std::copy(complex, complex + into.size(), into.begin());
  return into;
}

void LayerConvolution::transform_back(std::vector<double>& cells) {
  fftw_execute(static_cast<fftw_plan>(backward_));
  const size_t pitch = size_t{padded_width_} + 2;
  cells.resize(size_t{width_} * height_);
  for (uint32_t y = 0; y < height_; ++y)
    std::copy_n(work_ + y * pitch, width_, cells.begin() + static_cast<std::ptrdiff_t>(size_t{y} * width_));
}

void LayerConvolution::depth_by_pressure(const std::vector<double>& pressure, std::vector<double>& depth) {
  const Spectrum& p = transform(pressure, a_);
  auto* out = reinterpret_cast<std::complex<double>*>(work_);
  for (size_t i = 0; i < p.size(); ++i) out[i] = spectra_[kDepth][i].real() * p[i];
  transform_back(depth);
}

void LayerConvolution::depth_by_shear(const std::vector<double>& x, const std::vector<double>& y,
                                      std::vector<double>& depth) {
  const Spectrum &fx = transform(x, a_), &fy = transform(y, b_);
  auto* out = reinterpret_cast<std::complex<double>*>(work_);
  for (size_t i = 0; i < fx.size(); ++i)
    out[i] = -(spectra_[kXByPressure][i] * fx[i] + spectra_[kYByPressure][i] * fy[i]);
  transform_back(depth);
}

void LayerConvolution::shift_by_pressure(const std::vector<double>& pressure, std::vector<double>& x,
                                         std::vector<double>& y) {
  const Spectrum& p = transform(pressure, a_);
  auto* out = reinterpret_cast<std::complex<double>*>(work_);
  for (const auto& [part, to] : {std::pair{kXByPressure, &x}, std::pair{kYByPressure, &y}}) {
    for (size_t i = 0; i < p.size(); ++i) out[i] = spectra_[part][i] * p[i];
    transform_back(*to);
  }
}

void LayerConvolution::shift_by_shear(const std::vector<double>& x, const std::vector<double>& y,
                                      std::vector<double>& shift_x, std::vector<double>& shift_y) {
  const Spectrum &fx = transform(x, a_), &fy = transform(y, b_);
  auto* out = reinterpret_cast<std::complex<double>*>(work_);
  for (size_t i = 0; i < fx.size(); ++i) out[i] = spectra_[kXByX][i] * fx[i] + spectra_[kYByX][i] * fy[i];
  transform_back(shift_x);
  for (size_t i = 0; i < fx.size(); ++i) out[i] = spectra_[kYByX][i] * fx[i] + spectra_[kYByY][i] * fy[i];
  transform_back(shift_y);
}

}  // namespace palpate
