// Rest correction stage: heights where nothing touches the pad are errors of the surface. They are
// subtracted, with their harmonic continuation between.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/kernel.h"
#include "engine/numeric/membrane.h"
#include "engine/stages/surface/cell_heights.h"
#include "engine/stages/surface/surface.h"
#include "shaders/shared/cell_change.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// A surface from slopes has the pad's height at rest nowhere as a boundary value: errors of the slopes add
/// up to tilts and bowls. Where the pad is surely at rest its height is 0. Heights h and h - c obey the same
/// equation inside the contact if c is harmonic there, so that c, known where the pad is at rest and
/// continued harmonically, leaves the solution with that boundary value.
class RestCorrection {
 public:
  static constexpr double kLeastAtRest = 0.02;  ///< of all cells; with fewer nothing is corrected

  RestCorrection(gpu::Context& context, const Grid& grid);

  /// Host memory of a frame in flight.
  struct Slot {
    gpu::DeviceBuffer means;   ///< of each cell's heights, mm
    gpu::DeviceBuffer levels;  ///< what is taken off, mm
    gpu::TexelView level_texels;
  };
  Slot slot(gpu::Context& context) const;

  /// Leaves each cell's mean height in the slot.
  void record_means(gpu::Commands& commands, const FloatMap& depth, const Slot& slot) const;
  /// Writes the correction into the slot, from the means there and where the pad is at rest (a byte for each
  /// cell). False: too little of it is.
  bool find(const Slot& slot, std::span<const uint8_t> at_rest);
  /// Each cell's mean height of the last corrected frame, mm, and how far heights
  /// at rest scattered before, a standard deviation, mm.
  std::span<const float> depth_mm() const { return depth_mm_; }
  double error_mm() const { return error_mm_; }
  /// What was taken off each cell of the last corrected frame, mm.
  std::span<const float> level_mm() const { return levels_; }
  /// Takes it off.
  void record(gpu::Commands& commands, const FloatMap& depth, const Slot& slot) const;

 private:
  void smooth();

  CellHeights cells_;
  shared::CellChangePush push_;
  gpu::Kernel kernel_;
  Membrane membrane_;
  std::vector<float> levels_, scratch_, depth_mm_;
  double error_mm_ = 0;
};

}  // namespace palpate
