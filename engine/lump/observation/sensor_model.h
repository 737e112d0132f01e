// A sensor between a pressed block and what is read of it: light, pixels, 8 bits, noise, and back to pascals.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// A palpation sensor in the plate: light grows with pressure in proportion, a camera looks at a window of
/// the plate, and the calibration turns gray levels back into pressure.
struct PalpationSensor {
  std::array<uint32_t, 2> size_px = {640, 480};
  std::array<double, 2> window_mm = {40, 30};       ///< what the camera sees of the plate
  std::array<double, 2> window_center_mm = {0, 0};  ///< from the block's middle
  double full_scale_Pa = 0;                         ///< of gray level 255; 0: by the exposure
  double exposure = 0.9;        ///< the highest load's peak over full scale; above 1 its top is saturated
  double pixel_noise_gray = 1;  ///< standard deviation, before the level is rounded
  double node_pitch_mm = 1.25;  ///< of the observation: pixels are averaged around its nodes
  double least_cell = 0.9;  ///< fraction of the square around a node that the camera must see for it to count
  /// Noise after calibration: independent at each node, fraction of the highest load's peak
  /// pressure.
  double noise_fraction = 0.002;
  /// And a pattern that is the same at every load, fraction of the highest load's peak pressure: see
  /// fixed_pattern().
  double pattern_fraction = 0, pattern_length_mm = 3;
  bool pattern_gain = false;      ///< it grows with the pressure; else it is added
  double gauge_fraction = 0.001;  ///< standard deviation of the force, of each load by itself
};

/// Presses as this sensor reads them. `pressure_Pa` (nodes over the block, middle on its middle) and
/// `force_N` at rising loads. Values with more than one pixel in fifty at level 255 are NaN (not seen) and
/// counted in `saturated_fraction`. Deterministic by seed. Throws Error(Failure::Usage) naming a field that
/// is out of range.
Observation sensor_observation(const std::vector<PressureMap>& pressure_Pa,
                               const std::vector<double>& force_N, std::array<double, 3> block_mm,
                               double young_Pa, const PalpationSensor& sensor, uint64_t seed);

/// The same by an ideal sensor: means around nodes over the whole block, the true force, no noise.
Observation ideal_observation(const std::vector<PressureMap>& pressure_Pa, const std::vector<double>& force_N,
                              std::array<double, 3> block_mm, double young_Pa, double node_pitch_mm);

}  // namespace palpate::lump
