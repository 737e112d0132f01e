// Straight lines from readings with a gauge to the numbers of a sensor file.
#pragma once

#include <span>

#include "palpate/sensor.h"

namespace palpate {

struct ForceFit {
  ForceCalibration calibration;
  double r_squared = 0;           ///< fraction of the force's variance that the line explains
  double largest_residual_N = 0;  ///< of the readings, absolute
};

/// F = c1 G + c0 by least squares (Eq. 54): `gray_sum` are G in gray levels, `force_N` the gauge's readings
/// of the same frames. The calibrated range is that of the readings. Throws Error(Failure::Input) on fewer
/// than three readings, readings that do not vary, or a line that falls with G.
ForceFit fit_force(std::span<const double> gray_sum, std::span<const double> force_N);

struct StiffnessFit {
  double k_N_per_mm = 0;
  double relative_sd = 0;  ///< relative standard error of k
};

/// F = K u through the origin (Eq. 59, 60): `shift_mm` since the onset of the contact, only frames that
/// stick. Throws Error(Failure::Input) on fewer than two readings or no shift at all.
StiffnessFit fit_stiffness(std::span<const double> shift_mm, std::span<const double> force_N);

}  // namespace palpate
