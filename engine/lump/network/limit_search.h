// The smallest lump that an observation would have shown: of what is in the maps, noise and the sensor's own
// pattern, and of bumps as the emulator has them.
#pragma once

#include <array>
#include <vector>

#include "engine/lump/network/view.h"
#include "engine/lump/observation/sensor_model.h"

namespace palpate::lump {

/// Limits of detection around one place of an observation. A lump counts as seen where an estimate's evidence
/// reaches 1 nine times in ten.
class DetectionLimits {
 public:
  /// `place_mm` of the lump's centre, from the block's middle, as far off it as the model knows. `method`:
  /// whose evidence.
  DetectionLimits(const Model& model, const PressedNodes& nodes, Method method,
                  std::array<double, 2> place_mm);

  /// Evidence that a lump adds to what is seen without it, over what a lump has to add to be seen: at 1 and
  /// above it is.
  double evidence(const Guess& guess) const;
  /// The smallest diameter, mm, of kLeastSeen_mm and more: as much means as much or less. NaN: not even the
  /// largest that fits between surface and floor and that the model knows.
  double size_mm(InclusionShape shape, double depth_mm, double stiffness_ratio) const;

 private:
  Eigen::MatrixXd factors_of(const Guess& guess) const;

  const Model& model_;
  const PressedNodes& nodes_;
  PatchView view_;
  PatchErrors errors_;
  std::vector<PatternCovariance> patterns_;
  std::vector<double> energy_;  // of what is seen, by pattern
  double needed_ = 0;
};

/// Limits of balls in the middle of what is seen, at depths from 2 mm on that leave room for a lump and at
/// stiffness ratios of 2, 4 and 10; ratios are the outer order.
std::vector<DetectionLimit> detection_limits(const Model& model, const PressedNodes& nodes, Method method);

/// Tissue alone as a sensor would read it, pressed as the model has it, at rising forces.
Observation plain_observation(const Model& model, double thickness_mm, double young_Pa,
                              const std::vector<double>& force_N, const PalpationSensor& sensor,
                              uint64_t seed);

}  // namespace palpate::lump
