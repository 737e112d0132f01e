// The smallest lump that a press would show.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/lump/network/network.h"

namespace palpate::lump {

/// A press of tissue alone that is not made yet.
struct PlannedPress {
  std::vector<double> force_N;  ///< on the whole block, rising
  double young_Pa = 4000, thickness_mm = 20;
  std::array<double, 2> window_mm = {40, 30};  ///< what the sensor sees of the block's middle
  double noise_Pa = 0;                         ///< of a value over 1.25 mm, standard deviation
  double pattern_Pa = 0;  ///< what calibration leaves of the sensor's own pattern, alike at all loads
  uint64_t seed = 1;
};

/// Limits of the method `refined` in the middle of what such a press shows: of balls at depths from 2 mm on,
/// at stiffness ratios of 2, 4 and 10; ratios are the outer order. Throws Error(Failure::Usage) for tissue,
/// loads or noise that the network does not know.
std::vector<DetectionLimit> detection_limits(const Network& network, const PlannedPress& press);

/// "a ball 4 times as stiff as the tissue would be seen from 4.1 mm if 2 mm deep, ...". Empty without limits.
std::string sentence_of(const std::vector<DetectionLimit>& limits);

}  // namespace palpate::lump
