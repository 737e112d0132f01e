// Contacts of a ball that are no circles in the picture: pixels that are not square, or a picture that was
// scaled by other factors along x and y, make ellipses of them.
#pragma once

#include "capture/calibrate/photometric/presses.h"
#include "palpate/sensor.h"

namespace palpate {

struct BallStretch {
  /// The factor in height that makes circles of the contacts; 1: they are circles.
  double factor = 1;
  /// Change around the contacts that no ball explains, stretched over as they are.
  double left = 1;

  bool evident() const { return left < kEvident; }
  static constexpr double kEvident = 0.8;  ///< circles of four real gels left 1.1 and more
};
/// Stretch of a colour gel's pictures, from up to 8 of the presses.
BallStretch stretch_of(const BallPresses& found, const Sensor& sensor);

}  // namespace palpate
