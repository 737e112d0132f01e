// Gray sum to newtons, with what the calibration knows of its error (theory S5).
#pragma once

#include "engine/sensor.h"
#include "engine/touch.h"

namespace palpate {

/// Normal force of a reading G (gray levels): F = c1 G + c0 (Eq. 54), standard error of a single prediction.
/// Without contact the force is 0 with validity NoContact. A reading outside the calibrated range or with
/// saturated pixels says so.
Estimate force_from_gray(const ForceCalibration& calibration, double gray_sum, bool contact, bool saturated);

}  // namespace palpate
