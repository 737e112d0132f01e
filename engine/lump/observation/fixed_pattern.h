// The pattern that a sensor's calibration leaves: the same at every load of a press.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace palpate::lump {

/// A pattern over nodes `pitch_mm` apart, height x width: normal, of mean 0 and unit variance everywhere,
/// with covariance exp(-r^2 / (2 length^2)) over the distance r; a length of 0: each node by itself.
Eigen::MatrixXd fixed_pattern(uint32_t width, uint32_t height, double pitch_mm, double length_mm,
                              std::mt19937_64& random);

/// One of any kind, as calibrations leave them.
struct PatternKind {
  double length_mm = 0;  ///< white in a quarter of the cases, else 1 to 12 mm, even in its logarithm
  bool gain = false;     ///< grows with the pressure; else it is added
};
PatternKind any_pattern(std::mt19937_64& random);

}  // namespace palpate::lump
