// Curves from a contact's signal to newtons, fitted to readings with a gauge.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "palpate/sensor.h"

namespace palpate {

struct CurveFit {
  ForceCurve curve;
  std::array<double, 3>
      covariance{};          ///< var(c0), cov(c0, c1), var(c1), at the exponent found; not of splines
  double residual_sd_N = 0;  ///< RMS over the degrees of freedom that are left
};

/// Numbers that a model's fit to `readings` readings finds: 2, 3, and 4 to 8 knots; of a scale 1.
size_t unknowns(ForceModel model, size_t readings);

/// Least squares of force_N (gauge, N) on the signal, each reading counted by its weight (at least 0; empty:
/// all alike). Scale, line and power by their normal equations, the power's exponent searched from 0.2 to 5;
/// a spline's knots by constrained Gauss-Newton, so that force never falls with the signal. Throws
/// Error(Failure::Input) on fewer readings than one more than the unknowns, a signal or force that does not
/// vary, and a force that falls with the signal.
CurveFit fit_curve(ForceModel model, std::span<const double> signal, std::span<const double> force_N,
                   std::span<const double> weight = {});

/// The line F = c1 G + c0 as a sensor file holds it: `gray_sum` are G in gray levels, `force_N` the gauge's
/// readings of the same frames, whose range is the calibrated one. Throws what fit_curve throws.
ForceCalibration line_calibration(std::span<const double> gray_sum, std::span<const double> force_N);

}  // namespace palpate
