// The hand of the synthetic block: where it presses, how hard, and the texture of the skin that it presses.
#pragma once

#include <array>
#include <vector>

#include "capture/synthetic/scene.h"
#include "capture/synthetic/tissue_options.h"

namespace palpate {

class TissueHand {
 public:
  /// Deterministic by the options' seed.
  explicit TissueHand(const TissueOptions& options);

  Script script() const;  ///< forces over time
  HeldPose held(double time_s) const;
  /// Pressure at a place of the skin at rest, over that without texture.
  double share_at(const std::array<double, 2>& place_mm) const;

 private:
  std::vector<HeldPress> presses_;
  double slide_mm_, slide_s_;
  std::vector<double> force_N_;  // the highest of each
  PressureMap texture_;          // of the skin at rest, share of the pressure
};

}  // namespace palpate
