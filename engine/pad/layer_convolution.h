// Displacements of a pad's surface by traction on a grid of cells: zero-padded convolution with LayerKernel
// in double precision. Outside the grid nothing presses. The reference of the reading `elastic`, and a
// choice.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/numeric/transform/convolution.h"
#include "engine/pad/layer_kernel.h"

namespace palpate {

/// Plans and memory are made once; not thread safe.
class LayerConvolution {
 public:
  /// `shear`: also what shear traction does, and how the surface moves along itself.
  LayerConvolution(const LayerKernel& kernel, uint32_t width, uint32_t height, bool shear);

  uint32_t width() const { return convolution_.width(); }
  uint32_t height() const { return convolution_.height(); }
  bool has_shear() const { return has_shear_; }

  /// Depth, mm, by pressure, MPa: height x width each.
  void depth_by_pressure(const std::vector<double>& pressure, std::vector<double>& depth);
  /// The same of maps whose rows are `pitch` and `depth_pitch` elements apart.
  void depth_by_pressure(const float* pressure, uint32_t pitch, float* depth, uint32_t depth_pitch);
  /// Depth by shear traction along x and y, MPa; the transpose of what pressure shifts.
  void depth_by_shear(const std::vector<double>& x, const std::vector<double>& y, std::vector<double>& depth);
  /// Shift along x and y, mm, by pressure.
  void shift_by_pressure(const std::vector<double>& pressure, std::vector<double>& x, std::vector<double>& y);
  /// Shift by shear traction.
  void shift_by_shear(const std::vector<double>& x, const std::vector<double>& y,
                      std::vector<double>& shift_x, std::vector<double>& shift_y);

 private:
  enum Part { kDepth, kXByPressure, kYByPressure, kXByX, kYByX, kYByY, kParts };

  Convolution convolution_;
  bool has_shear_;
  std::array<Convolution::Kernel, kParts> parts_;
};

}  // namespace palpate
