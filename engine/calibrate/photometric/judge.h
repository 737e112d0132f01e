// How far off a model is on one press.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/calibrate/photometric/fit.h"
#include "engine/calibrate/photometric/press.h"
#include "engine/numeric/sparse.h"

namespace palpate::photometric {

/// Sums of one model's errors over presses.
struct ErrorSums {
  std::array<double, 2> square{};  // of n_x, n_y
  double angle2 = 0, pixels = 0, depth_square = 0, cap_square = 0, gain = 0;
  int balls = 0;

  HeldOutErrors errors() const;
};

/// Depth from the slopes of one patch, as integrate_patch; the equations are factored once. With `bridged`
/// the slopes go on, linear, across what is not inside, along row and column: a ball's do under a marker.
class Patch {
 public:
  Patch(std::span<const uint8_t> inside, uint32_t width, bool bridged);
  std::vector<double> depth(std::span<const double> slope_x, std::span<const double> slope_y,
                            double pitch_mm_per_px) const;

 private:
  struct Step {
    int from, to;          // unknowns
    size_t first, second;  // pixels
    bool across;
  };
  std::vector<int> index_;
  std::vector<Step> steps_;
  std::optional<sparse::Factor> factor_;  // none: nothing is inside
  int unknowns_ = 0;
};

/// Judges a model on one press, its depth where there is a patch; adds to the sums.
HeldOutPress judge(const PhotometricPress& p, const PhotometricCalibration& weights, const Patch* patch,
                   double pitch_mm_per_px, ErrorSums& sums);

}  // namespace palpate::photometric
