// Displacements of a bonded layer's surface by traction on a grid of cells: zero-padded convolution with
// LayerKernel by FFTW in double precision. Outside the grid nothing presses.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <vector>

#include "engine/elasticity/layer_kernel.h"

namespace palpate {

/// Plans and memory are made once; not thread safe.
class LayerConvolution {
 public:
  /// `shear`: also what shear traction does, and how the surface moves along itself.
  LayerConvolution(const LayerKernel& kernel, uint32_t width, uint32_t height, bool shear);
  ~LayerConvolution();
  LayerConvolution(const LayerConvolution&) = delete;
  LayerConvolution& operator=(const LayerConvolution&) = delete;

  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }
  bool has_shear() const { return !spectra_[kXByPressure].empty(); }

  /// Depth, mm, by pressure, MPa: height x width each.
  void depth_by_pressure(const std::vector<double>& pressure, std::vector<double>& depth);
  /// Depth by shear traction along x and y, MPa; the transpose of what pressure shifts.
  void depth_by_shear(const std::vector<double>& x, const std::vector<double>& y, std::vector<double>& depth);
  /// Shift along x and y, mm, by pressure.
  void shift_by_pressure(const std::vector<double>& pressure, std::vector<double>& x, std::vector<double>& y);
  /// Shift by shear traction.
  void shift_by_shear(const std::vector<double>& x, const std::vector<double>& y,
                      std::vector<double>& shift_x, std::vector<double>& shift_y);

 private:
  enum Part { kDepth, kXByPressure, kYByPressure, kXByX, kYByX, kYByY, kParts };
  using Spectrum = std::vector<std::complex<double>>;

  const Spectrum& transform(const std::vector<double>& cells, Spectrum& into);
  void transform_back(std::vector<double>& cells);

  uint32_t width_, height_, padded_width_, padded_height_;
  double* work_ = nullptr;  ///< padded_height x (padded_width + 2)
  void* forward_ = nullptr;
  void* backward_ = nullptr;
  std::array<Spectrum, kParts> spectra_;  ///< with the transforms' factor
  Spectrum a_, b_;                        ///< kept so that frames allocate nothing
};

}  // namespace palpate
