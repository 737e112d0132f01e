// Common parts of the calibrations by presses of known shapes: photometric and lookup.
#pragma once

#include <string>
#include <vector>

#include "capture/calibrate/photometric/ball_verdict.h"
#include "capture/calibrate/photometric/presses.h"
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

/// Writes the sensor file with the untouched image `background` next to it, or with an empty `run.out` only
/// names that image. `fresh`: the sensor has no name yet.
struct KeptSensor {
  std::string background;  ///< its copy; empty: there is none
  std::string line;        ///< "written: gel.json and gel_background.png"
};
KeptSensor keep_sensor(Sensor& sensor, const std::filesystem::path& background, const CalibrationRun& run,
                       bool fresh);

/// Lines above the numbers of a calibration by presses: the error first, then what was left out, the contacts
/// on the ball, and warnings.
struct PressVerdict {
  PressSelection selection;
  std::vector<BallEvidence> evidence;  ///< of all balls, and of each other shape
  std::string doubt;                   ///< about a shape's size or what was left out; may be empty
  std::string warning;                 ///< that the untouched image shows a touch; may be empty
};
/// Throws where the size of the ball cannot be (refuse_doubtful).
PressVerdict judge_presses(const BallPresses& found, const BallRequest& options, const Sensor& sensor);
/// `error`: "depth to 0.041 mm RMS ...". Several lines, each with an end.
std::string describe(const PressVerdict& verdict, const std::string& error);
/// Adds "verdict", "selection", "selection_text", "ball" or "shapes", "doubt" and "warning".
void add_verdict(const PressVerdict& verdict, const std::string& error, json::Value& report);

/// Presses that were left out: "press", "reason", and where one was seen the place of its circle.
json::Value refused_json(const BallPresses& found);

/// "0.0412 mm RMS, 15 % of the caps (0.273 mm RMS)"; the share is the same whatever size is stated.
std::string error_text(double depth_rmse_mm, double cap_rms_mm);

}  // namespace palpate
