// Frames of a force-calibrated sensor in a plate that presses a block of tissue, as an observation of what
// lies in the block.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/lump/observation/observation.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// A block of tissue under a sensor's window, as a person knows it.
struct BlockSetting {
  std::array<double, 3> block_mm = {40, 40, 20};  ///< length, width, thickness
  double young_Pa = 4000;                         ///< of the tissue
  std::array<double, 2> window_mm = {0, 0};       ///< the window's middle from the block's
};

/// Sums over the pixels around each node of a window, over some frames.
struct NodeSums {
  std::vector<double> pressure_Pa;
  std::vector<double> limited;  ///< pixels at the camera's limit
  double window_Pa = 0;         ///< all pixels of the window
  uint32_t frames = 0;

  void add(const NodeSums& other);
};

/// Gray less the untouched image, by the sensor's calibration to pressure, around nodes of the window.
class PressureNodes {
 public:
  /// The sensor reads pressure (reads_pressure) and has a scale; `background` has the frames' format.
  PressureNodes(const Sensor& sensor, const Frame& background, double pitch_mm);

  /// About 0.3 ms at 640 x 480.
  NodeSums read(const Frame& frame) const;
  /// On what the window sees, mean of the frames.
  double window_force_N(const NodeSums& sums) const;
  std::array<double, 2> window_mm() const;

  /// Mean pressure, Pa. Nodes with more than one in fifty pixels at the camera's limit are NaN (not seen)
  /// and counted, as a share, in `limited_fraction`. `noise_Pa`: of a value, what the calibration leaves and
  /// rounding to gray levels.
  PressureMap map(const NodeSums& sums, double& noise_Pa, double& limited_fraction) const;
  /// Pressure of one gray level, at small pressures.
  double Pa_per_gray() const { return 1e6 / sensor_.elastic.gray_per_MPa; }
  /// Standard error of the calibration, fraction of a pressure.
  double relative_sd() const { return sensor_.elastic.relative_sd > 0 ? sensor_.elastic.relative_sd : 0.01; }

 private:
  template <typename Pixel>
  void read_rows(const Frame& frame, NodeSums& sums) const;

  Sensor sensor_;
  Frame background_;
  double pitch_mm_;
  uint32_t width_ = 0, height_ = 0;            ///< nodes
  std::vector<uint32_t> first_x_, node_of_y_;  ///< pixels where the nodes' columns begin; rows' nodes
  std::vector<float> table_;                   ///< pressure over change of gray, from -max_gray on
};

/// Frames while a press loads whose force lies within 4 % of `highest_N` around `at_N`, the nearest first, at
/// most twelve. `force_N`: of each frame; after the highest one and the hold at it the press no longer loads.
std::vector<size_t> frames_near(const std::vector<double>& force_N, double at_N, double highest_N);
/// By how much frames of a load may differ from it, fraction of the highest force.
inline constexpr double kLoadWidth = 0.04;
/// Forces up to `top_N` in even shares.
std::vector<double> even_loads(double top_N, uint32_t count);

/// Frames of one load.
struct LoadSums {
  NodeSums nodes;
  double force_N = 0;  ///< on the whole block, mean of the frames
};
/// Loads at rising forces as an observation; nodes beside the block are not seen.
lump::Observation press_observation(const PressureNodes& nodes, const std::vector<LoadSums>& loads,
                                    const BlockSetting& block);

}  // namespace palpate
