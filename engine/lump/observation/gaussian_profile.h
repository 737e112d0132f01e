// A line through a stress map and the Gaussian that describes it (Eq. 81 of the source paper).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/tissue/pressure_map.h"

namespace palpate::lump {

/// Values along a line, each at its place.
struct Profile {
  std::vector<double> x_mm;   ///< rising
  std::vector<double> value;  ///< in the map's unit
};

/// a exp(-(x - x0)^2 / (2 s^2)) + offset.
struct GaussianFit {
  /// The line holds a bump or a dip: the search ended, s lies between a step and the line's length, and a is
  /// more than three of its standard errors from 0. Otherwise the numbers are what the search ended with.
  bool found = false;
  double amplitude = 0, center_mm = 0, width_mm = 0, offset = 0;  ///< width: s
  /// Standard errors of the four, of residuals that are independent from point to point. Those of a smooth
  /// model are not: there they measure how far the line is from a Gaussian, not noise.
  std::array<double, 4> sd{};
  double residual_rms = 0;
  double r_squared = 0;

  double at(double x_mm) const;
};

/// Centre of what differs from the map's median within the inner `fraction` of its sides, mm from its middle:
/// {0, 0} where nothing does.
std::array<double, 2> bump_center_mm(const PressureMap& map, double fraction = 0.8);

/// The map along x through y_mm (from its middle, linear between rows), x from the middle as well.
Profile profile_along_x(const PressureMap& map, double y_mm);

/// The part within |x| <= half_width_mm.
Profile inner_part(const Profile& profile, double half_width_mm);

/// Least squares by Levenberg-Marquardt from the line's own extremes. Throws Error(Failure::Input) on fewer
/// than six points or values that are not finite.
GaussianFit fit_gaussian(const Profile& profile);

}  // namespace palpate::lump
