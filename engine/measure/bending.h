// Bending of a gel's surface, read from its colours without a surface: how steeply their change varies over
// lengths at which a pad carries a load. Texture that is finer leaves no force, and light that drifts changes
// evenly; so this errs for other reasons than the layer's force does (pad/traction.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "palpate/frame.h"
#include "shaders/shared/cell_change.h"

namespace palpate {

class Bending {
 public:
  /// Smooths over a quarter of the pad's thickness, as the standard deviation of a bell.
  Bending(const FrameFormat& format, double pitch_mm_per_px, double thickness_mm);

  /// The untouched image: changes count relative to the mean of each of its colours.
  void set_background(const Frame& background);
  /// Steepness of the smoothed change, per mm, all colours in squares, integrated over the frame: mm.
  double measure(std::span<const shared::CellChange> cells);

 private:
  void smooth();

  FrameFormat format_;
  uint32_t cells_x_, cells_y_;
  double cell_mm_;
  std::vector<float> bell_;                  ///< one side of it, from its middle
  std::array<float, 3> mean_gray_{1, 1, 1};  ///< of the untouched image
  std::vector<float> change_, row_, squares_;
};

}  // namespace palpate
