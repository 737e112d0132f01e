// Common parts of the calibrations by presses of a known ball: photometric and lookup.
#pragma once

#include "capture/calibrate/presses.h"
#include "capture/calibrate/workflow/workflow.h"

namespace palpate {

/// Throws Error(Failure::Usage) unless the presses are either found by a radius or named by a table.
void check_ball_options(const BallRequest& options);

/// The sensor with the untouched image that the request names.
Sensor with_background(Sensor sensor, const BallRequest& options);

/// The presses that the table names, or those that are found, `least` or more. Throws as read_presses and
/// find_presses do.
BallPresses presses_of(const CalibrationRun& run, const BallRequest& options, const Sensor& sensor,
                       bool mask_markers, size_t least);

}  // namespace palpate
