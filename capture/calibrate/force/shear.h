// Calibration of shear, without a command line: from recordings and tangential gauge tables to K_x, K_y and
// the friction.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/calibrate/force/gauged_recording.h"
#include "engine/base/json.h"
#include "engine/calibrate/shear_fit.h"

namespace palpate {

struct ShearOutcome {
  std::vector<GaugedRecording> recordings;
  std::vector<ShearSample> samples;  ///< of the chosen signal
  ShearSignal signal = ShearSignal::Centroid;
  ShearFit fit;
  std::optional<ShearFit> other;  ///< of the signal that was not chosen, where it could be fitted
  ShearCalibration calibration;
  std::string friction_from;  ///< "from slip", "from the sensor file" or "given"
};

/// Settings that are given rather than fitted.
struct ShearRequest {
  std::optional<ShearSignal> signal;  ///< none: the one that leaves less of the force unexplained
  std::optional<double> friction;     ///< where no recording slips
};

/// Outputs to measure of an input; `signal` none: those that either needs.
Outputs shear_outputs(const MeasuredInput& input, std::optional<ShearSignal> signal);

/// The names of signals as the command line spells them.
inline const std::map<std::string, ShearSignal> kShearSignalNames = {{"centroid", ShearSignal::Centroid},
                                                                     {"skin", ShearSignal::Skin}};

/// Touched frames with their gauge readings. A contact whose normal force is not in the gauge's table has
/// the sensor's own, where that is valid.
std::vector<ShearSample> shear_samples(const std::vector<GaugedRecording>& recordings, ShearSignal signal);

/// The whole of it. `sensor`: pitch, and the friction to keep where nothing slips. Throws
/// Error(Failure::Input) where a direction is not pulled in, or where there is no friction to be had.
ShearOutcome calibrate_shear(std::vector<GaugedRecording> recordings, const Sensor& sensor,
                             const ShearRequest& request);

std::string describe(const ShearOutcome& outcome);
json::Value to_json(const ShearOutcome& outcome, const std::string& sensor_file);

}  // namespace palpate
