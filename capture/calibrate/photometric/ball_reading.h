// Depth that a calibrated sensor reads of presses of a known ball, as it reads a frame's.
#pragma once

#include <cstddef>

#include "capture/calibrate/photometric/presses.h"
#include "palpate/sensor.h"

namespace palpate {

namespace gpu {
class Context;
}

struct BallReading {
  size_t presses = 0;     ///< read
  double gain = 0;        ///< measured depth over the ball's cap, by least squares; median of the presses
  double error_mm = 0;    ///< RMS over the same pixels, with the best constant taken off; median
  double cap_rms_mm = 0;  ///< of the caps; median
  /// Standard error of `gain` by the calibration's own errors on presses left out, which change from place to
  /// place; 0: it states none.
  double gain_sd = 0;
};

/// Depth over the innermost `PhotometricFit::kJudgedShare` of the contact circles of `found`, each press
/// against its own untouched image. A surface that is read by colour or by a table of gray.
BallReading read_balls(gpu::Context& device, const Sensor& sensor, const BallPresses& found);

}  // namespace palpate
