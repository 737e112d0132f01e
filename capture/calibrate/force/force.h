// Calibration of force, without a command line: from recordings and gauge tables to a force calibration and a
// report on its quality.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/calibrate/force/gauged_recording.h"
#include "engine/base/json.h"
#include "engine/calibrate/force/choice.h"
#include "engine/calibrate/force/thickness.h"

namespace palpate {

/// Whether the sum of gradients is measured for a force calibration: of gels, whose pixels change with the
/// slope; or where it is asked for and frames have 8 bits.
bool may_show_slopes(const Sensor& sensor, bool asked = false);

/// Outputs to measure of an input: no more than the signal needs; without a signal all that any may need.
Outputs force_outputs(const MeasuredInput& input, std::optional<ForceSignal> signal);

/// The names of signals and models as the command line spells them.
inline const std::map<std::string, ForceSignal> kForceSignalNames = {
    {"gray-sum", ForceSignal::GraySum}, {"gradient", ForceSignal::Gradient},
    {"area", ForceSignal::Area},        {"volume", ForceSignal::Volume},
    {"layer", ForceSignal::Layer},      {"layer-bending", ForceSignal::LayerAndBending}};
inline const std::map<std::string, ForceModel> kForceModelNames = {{"line", ForceModel::Line},
                                                                   {"power", ForceModel::Power},
                                                                   {"spline", ForceModel::Spline},
                                                                   {"layer", ForceModel::Scale}};

/// Names of what each of `count` recordings presses; empty ones where no name is given. Throws
/// Error(Failure::Usage) for another number of names, and for an empty one.
std::vector<std::string> named_objects(std::vector<std::string> names, size_t count);

/// Touched frames with their gauge readings, for the fit; saturated ones, those at the border and those
/// without a reading stay in, marked. Presses are numbered over all recordings; those of one folder are of
/// one day. `keep_border`: contacts at
/// the border count, for pads that objects or their glow outgrow.
std::vector<ForceSample> force_samples(const std::vector<GaugedRecording>& recordings,
                                       bool keep_border = false);

/// A calibration on a recording that it was not made from.
struct ForceCheck {
  std::string input, gauge;
  size_t readings = 0;         ///< valid estimates with a gauge reading
  size_t flagged = 0;          ///< touched frames whose estimate says of itself that it is not valid
  double flagged_error_N = 0;  ///< their mean absolute error
  double mean_error_N = 0;     ///< absolute
  double rms_error_N = 0;
  double median_relative =
      0;               ///< absolute error over the gauge's reading, of readings above 5 % of full scale
  double above_N = 0;  ///< of readings from this force on (1 N, or a tenth of the full scale below 10 N):
  size_t above_readings = 0;
  double above_error_N = 0;  ///< their mean absolute error
  double coverage = 0;       ///< fraction within the stated 95 % interval
};
ForceCheck check_force(const ForceCalibration& calibration, const GaugedRecording& recording,
                       bool keep_border = false);

/// Recordings as a layer of the thickness that they decide reads them, else of the stated one.
struct LayerPresses {
  std::vector<GaugedRecording> recordings;
  std::optional<ThicknessChoice> thickness;  ///< none: not looked for
  double factor() const { return thickness && thickness->decided ? thickness->factor : 1; }
};

/// Measures `count` recordings, `measure(i, factor)` the i-th with the layer `factor` times as thick as
/// `sensor` has it: where the options ask for a layer that reads a surface, as often as choose_thickness()
/// needs. Each time its clock is compared with the gauge's. Nothing is left of them once `options.stopped`.
LayerPresses measure_presses(size_t count, const ForceChoiceOptions& options, const Sensor& sensor,
                             bool keep_border,
                             const std::function<GaugedRecording(size_t i, double factor)>& measure);

struct ForceOutcome {
  std::vector<GaugedRecording> recordings;
  std::optional<ThicknessChoice> thickness;
  std::vector<ForceSample> samples;
  ForceChoice choice;
  std::vector<ForceCheck> checks;
};

/// The whole of it for recordings that are measured already. Fills the calibration's origin.
ForceOutcome calibrate_force(LayerPresses presses, const ForceChoiceOptions& options,
                             bool keep_border = false);
ForceOutcome calibrate_force(std::vector<GaugedRecording> recordings, const ForceChoiceOptions& options,
                             bool keep_border = false);

/// Puts a calibration into a sensor. That of the layer's force becomes the layer's modulus, with its standard
/// error, and a force of scale 1, or of scales about 1 where loading and unloading are apart. Where the
/// bending counts too, the modulus keeps the error that it had, for the presses state that of the mean alone.
/// `thickness`: of the layer over what the sensor has.
void set_force(Sensor& sensor, const ForceCalibration& calibration, double thickness = 1);

/// A calibration is not fit for use where its interval is wider than kWorstInterval of full scale, where it
/// rests on fewer than kFewestReadings, where its full scale is less than kLeastReach of what was pressed, or
/// where more than kMostOutliers contradict it and were left out. The line states what was left out where
/// that is more than what was used.
struct ForceVerdict {
  static constexpr double kWorstInterval = 0.3;
  static constexpr size_t kFewestReadings = 20;
  static constexpr double kLeastReach = 0.5;
  static constexpr double kMostOutliers = 0.2;  ///< of used readings and outliers together

  bool fit_for_use = true;
  /// false: on a gel, fewer than three recordings (of three objects): others were not judged.
  bool shapes_judged = true;
  double interval_fraction = 0;  ///< half the 95 % interval at full scale, over full scale
  double reach = 1;              ///< full scale over the gauge's largest reading while something touches
  size_t presses = 0;            ///< that the fit used
  std::string line;              ///< "good to 3.1 % of full scale ..." or "not fit for use: ..."; one line
};

ForceVerdict verdict_of(const ForceOutcome& outcome);

/// The tables as text, and the same as a JSON object (text).
std::string describe(const ForceOutcome& outcome);
json::Value to_json(const ForceOutcome& outcome, const std::string& sensor_file);
/// One line a sample: recording, frame, time_s, press, the signals, force_N, fitted_N, held_out_N,
/// unloading, left_out.
std::string samples_csv(const ForceOutcome& outcome);

}  // namespace palpate
