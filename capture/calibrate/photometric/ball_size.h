// The size of a ball, as people state it.
#pragma once

namespace palpate {

/// Stated once, in one of three ways; 0: not so.
struct BallSize {
  double radius_mm = 0;
  double diameter_mm = 0;
  double unsaid_mm = 0;  ///< by the older option --ball-mm: a radius, for which people give diameters too

  int times_given() const { return (radius_mm > 0) + (diameter_mm > 0) + (unsaid_mm > 0); }
  /// Radius, mm.
  double radius() const { return radius_mm > 0 ? radius_mm : diameter_mm > 0 ? diameter_mm / 2 : unsaid_mm; }
};

}  // namespace palpate
