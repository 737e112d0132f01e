#include "capture/calibrate/force/force.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

// Frames whose saturated pixels may hide more of the signal than this are not fitted.
constexpr double kMostHidden = 0.02;

/// Recordings that lie in one folder count as of one day.
std::filesystem::path folder_of(const GaugedRecording& recording) {
  std::filesystem::path input = std::filesystem::path(recording.input).lexically_normal();
  if (!input.has_filename()) input = input.parent_path();
  return input.parent_path();
}

}  // namespace

bool may_show_slopes(const Sensor& sensor, bool asked) {
  return sensor.bit_depth == 8 && (asked || sensor.signal == Signal::Either);
}

Outputs force_outputs(const MeasuredInput& input, std::optional<ForceSignal> signal) {
  Outputs outputs = input.outputs;
  // A volume needs the surface; without it that work is saved.
  if (signal && signal != ForceSignal::Volume && !is_by_layer(*signal)) outputs = Output::Force;
  // Whatever the force is read by, clocks are best compared by the sum of gradients, where there is one.
  if (may_show_slopes(input.sensor, signal == ForceSignal::Gradient)) outputs |= Output::Gradient;
  return outputs;
}

std::vector<std::string> named_objects(std::vector<std::string> names, size_t count) {
  if (names.empty())
    names.resize(count);
  else if (names.size() != count || std::ranges::find(names, "") != names.end())
    throw Error(Failure::Usage, "an object for each recording, in the same order",
                std::to_string(count) + " recordings and " +
                    std::to_string(std::ranges::count_if(names, [](auto& n) { return !n.empty(); })) +
                    " objects",
                "one name for each, the same for recordings of one object");
  return names;
}

std::vector<ForceSample> force_samples(const std::vector<GaugedRecording>& recordings, bool keep_border) {
  std::vector<ForceSample> samples;
  uint32_t presses = 0;
  std::map<std::string, uint32_t> objects;
  std::map<std::filesystem::path, uint32_t> days;
  const auto number = [](auto& known, const auto& name) {
    return known.emplace(name, static_cast<uint32_t>(known.size())).first->second;
  };
  for (size_t r = 0; r < recordings.size(); ++r) {
    bool touching = false;
    const uint32_t day = number(days, folder_of(recordings[r]));
    std::optional<uint32_t> object;
    if (!recordings[r].object.empty()) object = number(objects, recordings[r].object);
    for (const GaugedFrame& f : recordings[r].frames) {
      if (!f.touch.contact) {
        touching = false;
        continue;
      }
      if (!touching || recordings[r].separate) ++presses;
      touching = true;
      ForceSample s;
      s.features = force_features(f.touch);
      s.force_N = f.force_N;
      s.time_s = f.time_s;
      s.frame = f.touch.sequence;
      s.recording = static_cast<uint32_t>(r);
      s.press = presses - 1;
      s.object = object;
      s.day = day;
      if (!std::isfinite(f.force_N))
        s.left_out = LeftOut::NoGauge;
      else if (std::max(s.features.hidden_gray, s.features.hidden_slopes) > kMostHidden)
        s.left_out = LeftOut::Saturated;
      else if (s.features.at_border && !keep_border)
        s.left_out = LeftOut::AtBorder;
      samples.push_back(s);
    }
  }
  return samples;
}

ForceCheck check_force(const ForceCalibration& calibration, const GaugedRecording& recording,
                       bool keep_border) {
  ForceCheck check;
  check.input = recording.input;
  check.gauge = recording.gauge;
  const double full_N = calibration.force_max_N;
  check.above_N = full_N >= 10 ? 1 : 0.1 * full_N;
  ForceHistory history;
  ForceCalibration judged = calibration;
  judged.shapes_judged = judged.fit_for_use = true;  // its numbers are wanted whatever was said of it
  std::vector<double> relative;
  size_t inside = 0;
  for (const GaugedFrame& f : recording.frames) {
    ForceFeatures features = force_features(f.touch);
    if (keep_border) {
      features.at_border = false;
      if (features.layer_validity == Validity::AtBorder) features.layer_validity = Validity::Valid;
    }
    if (recording.separate) history.interrupt();
    const Estimate e = history.update(judged, features);
    if (!f.touch.contact || !std::isfinite(f.force_N)) continue;
    const double error_N = std::abs(e.value - f.force_N);
    if (e.validity != Validity::Valid) {
      ++check.flagged;
      check.flagged_error_N += error_N;
      continue;
    }
    ++check.readings;
    check.mean_error_N += error_N;
    check.rms_error_N += error_N * error_N;
    inside += error_N <= 1.96 * e.standard_error;
    if (f.force_N >= 0.05 * full_N) relative.push_back(error_N / f.force_N);
    if (f.force_N < check.above_N) continue;
    ++check.above_readings;
    check.above_error_N += error_N;
  }
  const double n = static_cast<double>(std::max<size_t>(check.readings, 1));
  check.mean_error_N /= n;
  check.rms_error_N = std::sqrt(check.rms_error_N / n);
  check.coverage = static_cast<double>(inside) / n;
  check.flagged_error_N /= static_cast<double>(std::max<size_t>(check.flagged, 1));
  check.above_error_N /= static_cast<double>(std::max<size_t>(check.above_readings, 1));
  if (!relative.empty()) {
    const auto middle = relative.begin() + static_cast<ptrdiff_t>(relative.size() / 2);
    std::nth_element(relative.begin(), middle, relative.end());
    check.median_relative = *middle;
  }
  return check;
}

LayerPresses measure_presses(size_t count, const ForceChoiceOptions& options, const Sensor& sensor,
                             bool keep_border,
                             const std::function<GaugedRecording(size_t i, double factor)>& measure) {
  const auto stopped = [&] { return options.stopped && options.stopped(); };
  const auto measure_all = [&](double factor) {
    std::vector<GaugedRecording> recordings;
    for (size_t i = 0; i < count && !stopped(); ++i) recordings.push_back(measure(i, factor));
    return recordings;
  };
  LayerPresses presses{.recordings = measure_all(1), .thickness = {}};
  const bool by_layer =
      options.model == ForceModel::Scale || (options.signal && is_by_layer(*options.signal));
  if (!by_layer || !sensor.layer || sensor.reading == SurfaceReading::Elastic || stopped()) return presses;
  const std::vector<ForceSample> samples = force_samples(presses.recordings, keep_border);
  if (const size_t objects = count_objects(samples); objects < kFewestObjects) {
    presses.thickness = ThicknessChoice{.objects = objects};
    return presses;
  }
  std::vector<ThicknessForces> layer_N(samples.size());
  for (size_t k = 0; k < kThicknesses.size(); ++k) {
    std::map<std::pair<uint32_t, uint64_t>, double> by_frame;
    for (const ForceSample& s :
         kThicknesses[k] == 1 ? samples : force_samples(measure_all(kThicknesses[k]), keep_border))
      if (s.features.has_layer) by_frame[{s.recording, s.frame}] = s.features.layer_N;
    for (size_t i = 0; i < samples.size(); ++i) {
      const auto there = by_frame.find({samples[i].recording, samples[i].frame});
      layer_N[i][k] = there == by_frame.end() ? kNaN : there->second;
    }
  }
  presses.thickness = choose_thickness(samples, layer_N);
  if (presses.thickness->decided) presses.recordings = measure_all(presses.thickness->factor);
  return presses;
}

ForceOutcome calibrate_force(LayerPresses presses, const ForceChoiceOptions& options, bool keep_border) {
  ForceOutcome outcome = calibrate_force(std::move(presses.recordings), options, keep_border);
  outcome.thickness = presses.thickness;
  return outcome;
}

ForceOutcome calibrate_force(std::vector<GaugedRecording> recordings, const ForceChoiceOptions& options,
                             bool keep_border) {
  ForceOutcome o;
  o.recordings = std::move(recordings);
  if (options.model == ForceModel::Scale || (options.signal && is_by_layer(*options.signal)))
    for (GaugedRecording& r : o.recordings)
      for (GaugedFrame& f : r.frames) f.touch.gradient_sum.reset();  // for the clocks; the layer knows shapes
  o.samples = force_samples(o.recordings, keep_border);
  o.choice = choose_force(o.samples, options);
  if (o.choice.stopped) return o;
  const ForceVerdict verdict = verdict_of(o);
  o.choice.calibration.fit_for_use = verdict.fit_for_use;
  o.choice.calibration.shapes_judged = verdict.shapes_judged;
  const size_t left_out = o.samples.size() - o.choice.readings;
  o.choice.calibration.origin =
      origin_of(o.recordings, palpate::text("%s, %zu readings, %zu left out, held-out error %.3g N",
                                            to_string(o.choice.chosen.candidate).c_str(), o.choice.readings,
                                            left_out, o.choice.chosen.error_N) +
                                  (verdict.fit_for_use ? "" : "; " + verdict.line));
  return o;
}

void set_force(Sensor& sensor, const ForceCalibration& calibration, double thickness) {
  sensor.force = calibration;
  if (sensor.layer) sensor.layer->thickness_mm *= thickness;
  if (!is_by_layer(calibration.signal) || !sensor.layer) return;
  ForceCalibration& force = *sensor.force;
  LayerCalibration& layer = *sensor.layer;
  const double scale = force.c1_N_per_gray;
  // The wrench does not tell the directions apart: what they differ by is its error.
  const double apart = force.loading ? 0.5 * (force.loading->c1 - force.unloading->c1) / scale : 0;
  for (std::optional<ForceCurve>* branch : {&force.loading, &force.unloading})
    if (*branch) (*branch)->c1 /= scale;
  layer.young_MPa *= scale;
  if (force.signal == ForceSignal::Layer)
    layer.relative_sd = std::hypot(std::sqrt(force.covariance[2]) / scale, force.residual_fraction, apart);
  force.bending_N_per_mm *= scale;
  layer.origin = force.origin;
  force.c1_N_per_gray = 1;
  force.covariance = {};
  force.gray_min *= scale;
  force.gray_max *= scale;
}

}  // namespace palpate
