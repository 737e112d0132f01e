// Convolutions of maps with kernels that are even or odd along each axis. Outside the map there is nothing:
// the transforms are of at least twice its size.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/numeric/transform/lane_fft.h"

namespace palpate {

/// Plans and memory are made once; not thread safe.
class Convolution {
 public:
  /// `width`, `height` > 0.
  Convolution(uint32_t width, uint32_t height);

  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }

  /// Transformed. Only of the size that it was made for.
  class Kernel {
    friend class Convolution;
    std::vector<std::array<double, kLaneCount>> spectrum_;
    bool odd_ = false;  ///< the spectrum is imaginary
  };
  /// `answer`: height x width, what a unit at (0, 0) makes at (x, y).
  Kernel kernel(std::span<const double> answer, bool odd_in_x, bool odd_in_y);

  /// height x width, rows `pitch` elements apart.
  template <typename Real>
  struct Map {
    Real* values = nullptr;
    uint32_t pitch = 0;
  };
  /// Sum of the inputs convolved with their `kernels[i]`, times `factor`; no kernel: nothing.
  template <typename Real>
  struct Sum {
    Map<Real> to;
    std::array<const Kernel*, 2> kernels{};
    double factor = 1;
  };
  /// One or two inputs to one or two sums; all of `from` are read before any sum is written. Real is float or
  /// double.
  template <typename Real>
  void apply(std::span<const Map<const Real>> from, std::span<const Sum<Real>> sums);

 private:
  using Rows = std::vector<LaneRow>;

  /// Spectra along y of a map of `columns` x `rows`: eight waves a row, a column after the other.
  template <typename Real>
  void transform_columns(Map<const Real> from, uint32_t columns, uint32_t rows, Rows& waves);
  template <typename Real>
  void transform_back(const Rows& waves, Map<Real> to, double factor);
  /// The spectrum along both axes of a block of eight waves, in one of the pair's buffers.
  const LaneRow* transform_rows(const Rows& waves, uint32_t block, uint32_t columns,
                                std::array<Rows, 2>& pair);
  uint32_t wave_blocks() const;
  uint32_t padded_columns(uint32_t columns) const;

  uint32_t width_, height_;
  LaneFft along_x_, along_y_;  ///< of the padded size
  std::array<Rows, 2> waves_;  ///< of up to two maps
  std::array<std::array<Rows, 2>, 2> rows_;
  Rows spare_;
};

}  // namespace palpate
