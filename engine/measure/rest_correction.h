// Rest correction: heights where nothing touches the pad are errors of the surface. They are subtracted, with
// their harmonic continuation between.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/measure/height_rows.h"
#include "engine/numeric/membrane.h"

namespace palpate {

/// A surface from slopes has the pad's height at rest nowhere as a boundary value: errors of the slopes add
/// up to tilts and bowls. Where the pad is surely at rest its height is 0. Heights h and h - c obey the same
/// equation inside the contact if c is harmonic there, so that c, known where the pad is at rest and
/// continued harmonically, leaves the solution with that boundary value.
class RestCorrection {
 public:
  static constexpr double kLeastAtRest = 0.02;  ///< of all cells; with fewer nothing is corrected

  /// Of maps of so many px.
  RestCorrection(uint32_t width, uint32_t height);

  /// The frame that `find` is for.
  void look_at(const HeightRows& heights) { cell_means(heights, means_); }
  /// Finds what to take off, given where the pad is at rest (a byte for each cell). False: too little of it
  /// is.
  bool find(std::span<const uint8_t> at_rest);
  /// Mean height of each cell of that frame, mm.
  std::span<const float> means_mm() const { return means_; }
  /// Each cell's mean height of the last corrected frame, mm, and how far heights
  /// at rest scattered before, a standard deviation, mm.
  std::span<const float> depth_mm() const { return depth_mm_; }
  double error_mm() const { return error_mm_; }
  /// Mean height of the last frame that was corrected, where the pad was at rest, mm.
  double rest_level_mm() const { return rest_level_mm_; }
  /// Height to take off each cell of the last corrected frame, mm (take_off).
  std::span<const float> level_mm() const { return levels_; }

 private:
  void smooth();

  uint32_t cells_x_, cells_y_;
  Membrane membrane_;
  std::vector<float> means_, levels_, scratch_, depth_mm_;
  double error_mm_ = 0, rest_level_mm_ = 0;
};

}  // namespace palpate
