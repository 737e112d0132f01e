#include "capture/calibrate/force/force.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>

#include "engine/base/json.h"
#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

// Frames whose saturated pixels may hide more of the signal than this are not fitted.
constexpr double kMostHidden = 0.02;

using Json = json::Value;

const char* unit_of(ForceSignal signal) {
  switch (signal) {
    case ForceSignal::GraySum:
      return "gray";
    case ForceSignal::Area:
      return "px";
    case ForceSignal::Volume:
      return "mm3";
    case ForceSignal::Gradient:
      return "gray-px";
    case ForceSignal::Layer:
    case ForceSignal::LayerAndBending:
      return "N";
  }
  return "";
}

double full_scale(const ForceOutcome& o) {
  return o.choice.calibration.force_max_N;
}

std::map<LeftOut, size_t> counts_of(const ForceOutcome& o) {
  std::map<LeftOut, size_t> counts;
  for (const ForceSample& s : o.samples) ++counts[s.left_out];
  return counts;
}

/// Frames of outliers, for people: "12, 13, 140" of at most six.
std::string outliers(const ForceOutcome& o) {
  std::string text;
  size_t count = 0;
  for (const ForceSample& s : o.samples) {
    if (s.left_out != LeftOut::Outlier || ++count > 6) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(s.frame) +
            (o.recordings.size() > 1 ? " of recording " + std::to_string(s.recording + 1) : "");
  }
  return count > 6 ? text + ", ..." : text;
}

Json curve_json(const BranchLine& l) {
  return {{"c1", l.curve.c1}, {"c0_N", l.curve.c0_N}, {"r_squared", l.r_squared}, {"readings", l.readings}};
}

Json or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

std::string curve_text(const ForceCalibration& c) {
  const char* unit = unit_of(c.signal);
  switch (c.model) {
    case ForceModel::Line:
      return palpate::text("F = %.5g N/%s s %+.5g N", c.c1_N_per_gray, unit, c.c0_N);
    case ForceModel::Scale:
      if (c.signal == ForceSignal::LayerAndBending)
        return palpate::text(
            "F = %.4g times the mean of the layer's force and of %.4g N/mm times the bending: that many "
            "times its modulus",
            c.c1_N_per_gray, c.bending_N_per_mm);
      return palpate::text("F = %.4g times the layer's force: that many times its modulus", c.c1_N_per_gray);
    case ForceModel::Power:
      return palpate::text("F = %.5g (s/%s)^%.4g N %+.5g N", c.c1_N_per_gray, unit, c.exponent, c.c0_N);
    case ForceModel::Spline:
      return palpate::text("F rises through %zu knots from %.4g N to %.4g N", c.knots.size(),
                           c.knots.front()[1], c.knots.back()[1]);
  }
  return "";
}

/// Recordings that lie in one folder, of which each is left out whole: those of a day err alike.
struct FolderError {
  size_t folders = 0;
  double error_N = 0;  ///< mean absolute, of each folder's readings by the curve of the others
};
std::optional<FolderError> left_out_folders(const ForceOutcome& o) {
  std::map<std::filesystem::path, size_t> number;
  std::vector<size_t> folder;
  for (const GaugedRecording& r : o.recordings)
    folder.push_back(
        number.emplace(std::filesystem::path(r.input).parent_path(), number.size()).first->second);
  if (number.size() < 2) return std::nullopt;
  const ForceCandidate& c = o.choice.chosen.candidate;
  FolderError found{.folders = number.size()};
  double readings = 0;
  for (size_t out = 0; out < number.size(); ++out) try {
      const auto of_folder = [&](size_t i) { return folder[o.samples[i].recording] == out; };
      const auto counts = [&](size_t i) { return !of_folder(i); };
      const ForceTrack track = track_of(c.signal, o.samples, counts);
      const ForceCurves curves = fit_curves(c.model, c.branches, track, o.samples, counts);
      for (size_t i = 0; i < o.samples.size(); ++i) {
        if (!is_used(o.samples[i]) || !of_folder(i)) continue;
        found.error_N += std::abs(curves.at(track.signal[i], track.unloading[i]) - o.samples[i].force_N);
        readings += 1;
      }
    } catch (const Error&) {
      return std::nullopt;  // the others alone are too few
    }
  if (!(readings > 0)) return std::nullopt;
  found.error_N /= readings;
  return found;
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

std::vector<ForceSample> force_samples(const std::vector<GaugedRecording>& recordings, bool keep_border) {
  std::vector<ForceSample> samples;
  uint32_t presses = 0;
  for (size_t r = 0; r < recordings.size(); ++r) {
    bool touching = false;
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
    if (keep_border) features.at_border = false;
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
  if (count < kFewestRecordings) {
    presses.thickness = ThicknessChoice{.recordings = count};
    return presses;
  }
  const std::vector<ForceSample> samples = force_samples(presses.recordings, keep_border);
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

std::string describe(const ForceOutcome& o) {
  const ForceChoice& c = o.choice;
  const ForceCalibration& f = c.calibration;
  const double full_N = full_scale(o);
  std::string text = verdict_of(o).line + "\n\n";
  for (const GaugedRecording& r : o.recordings) text += describe(r);
  text += palpate::text("%zu touched frames, %zu used", o.samples.size(), c.readings);
  for (const auto& [why, count] : counts_of(o))
    if (why != LeftOut::Used) text += palpate::text(", %zu %s", count, to_string(why));
  if (const std::string frames = outliers(o); !frames.empty()) text += " (frames " + frames + ")";
  text += palpate::text("\n\nheld out: %zu blocks of %s, one after the other\n", c.blocks, c.blocks_are);
  text += "curve                              error, N   worse than the best, N\n";
  for (const CandidateScore& s : c.scores) {
    const std::string name = to_string(s.candidate);
    const ForceCandidate &a = s.candidate, &b = c.chosen.candidate;
    const bool chosen = a.signal == b.signal && a.model == b.model && a.branches == b.branches;
    if (!s.refused.empty())
      text += palpate::text("%-32s          -   not fitted: %.200s\n", name.c_str(), s.refused.c_str());
    else
      text += palpate::text(
          "%-32s %10.4g   %.3g +- %.2g%s\n", name.c_str(), s.error_N, s.worse_N, s.worse_sd_N,
          chosen                         ? "   <- chosen: the simplest within a standard error"
          : !s.eligible && s.worse_N < 0 ? "   (only with --signal: see capture/calibrate/README.md)"
                                         : "");
  }
  if (const std::optional<FolderError> whole = left_out_folders(o))
    text += palpate::text(
        "of whole folders left out, one of %zu after the other: error %.4g N (%.2g %% of full scale)\n",
        whole->folders, whole->error_N, 100 * whole->error_N / full_N);
  text += "\n" + curve_text(f) + "\n";
  if (o.thickness) text += o.thickness->line() + "\n";
  if (f.signal == ForceSignal::Area || f.signal == ForceSignal::Volume)
    text += palpate::text(
        "note: force by %s holds for objects shaped as those pressed here; --signal gray-sum where others "
        "will "
        "press\n",
        to_string(f.signal));
  text += palpate::text("R^2 %.6f, residual %.3g N RMS (largest %.3g N), held out %.3g N RMS\n", f.r_squared,
                        c.residual_rms_N, c.largest_residual_N, c.held_out_rms_N);
  text += palpate::text(
      "95 %% interval: +- %.3g N at %.3g N (full scale), +- %.3g N near 0; it held %.1f %% of held-out "
      "readings\n",
      c.interval_full_N, full_N, 1.96 * f.residual_sd_N, 100 * c.interval_coverage);
  text += palpate::text("calibrated from %.6g to %.6g %s (%s), forces up to %.4g N\n", f.gray_min, f.gray_max,
                        unit_of(f.signal), to_string(f.signal), full_N);
  if (c.has_hysteresis)
    text += palpate::text("hysteresis %.2f %% of full scale, at %.5g %s\n", 100 * f.hysteresis,
                          c.hysteresis_signal, unit_of(f.signal));
  else
    text += "hysteresis: not determined, loading and unloading were not both seen over a common range\n";
  if (std::isfinite(c.drift_sd_N_per_min))
    text += palpate::text("drift %+.3g N/min +- %.2g\n", f.drift_N_per_min, c.drift_sd_N_per_min);
  else
    text += "drift: not determined, times are not known or span less than 10 s\n";
  text += palpate::text("\nthe line F = c1 s + c0 (Eq. 54)      c1, N/%-8s c0, N        R^2   readings\n",
                        unit_of(f.signal));
  const auto row = [&](const char* name, const std::optional<BranchLine>& l) {
    if (l)
      text += palpate::text("%-32s %13.6g %12.5g %10.6f %8zu\n", name, l->curve.c1, l->curve.c0_N,
                            l->r_squared, l->readings);
    else
      text += palpate::text("%-32s             too few readings\n", name);
  };
  row("together", c.line);
  row("loading", c.loading);
  row("unloading", c.unloading);
  for (const ForceCheck& k : o.checks) {
    text += palpate::text(
        "\non %s, not used above: mean error %.3g N (%.2f %% of full scale), RMS %.3g N, from %.3g N on "
        "%.3g N (%.2f %%), median %.2f %% of the reading; the 95 %% interval held %.1f %% of %zu readings",
        k.input.c_str(), k.mean_error_N, 100 * k.mean_error_N / full_N, k.rms_error_N, k.above_N,
        k.above_error_N, 100 * k.above_error_N / full_N, 100 * k.median_relative, 100 * k.coverage,
        k.readings);
    if (k.flagged)
      text += palpate::text(
          "; %zu more say that they are out of range, saturated or at the border (mean error %.3g N)",
          k.flagged, k.flagged_error_N);
    text += "\n";
  }
  return text;
}

json::Value to_json(const ForceOutcome& o, const std::string& sensor_file) {
  const ForceChoice& c = o.choice;
  const ForceCalibration& f = c.calibration;
  Json scores = Json::array(), left_out = Json::object(), checks = Json::array();
  for (const CandidateScore& s : c.scores) {
    Json value = {{"signal", to_string(s.candidate.signal)},
                  {"model", to_string(s.candidate.model)},
                  {"branches", s.candidate.branches}};
    if (s.refused.empty()) {
      value["error_N"] = s.error_N;
      value["worse_N"] = s.worse_N;
      value["worse_sd_N"] = s.worse_sd_N;
      value["eligible"] = s.eligible;
    } else {
      value["refused"] = s.refused;
    }
    scores.push_back(value);
  }
  for (const auto& [why, count] : counts_of(o))
    if (why != LeftOut::Used) left_out[to_string(why)] = count;
  for (const ForceCheck& k : o.checks)
    checks.push_back({{"input", k.input},
                      {"gauge", k.gauge},
                      {"readings", k.readings},
                      {"flagged", k.flagged},
                      {"flagged_mean_error_N", k.flagged_error_N},
                      {"mean_error_N", k.mean_error_N},
                      {"rms_error_N", k.rms_error_N},
                      {"median_relative_error", k.median_relative},
                      {"from_N", k.above_N},
                      {"from_readings", k.above_readings},
                      {"from_mean_error_N", k.above_error_N},
                      {"coverage_95", k.coverage}});
  Json lines = {{"together", curve_json(c.line)}};
  if (c.loading) lines["loading"] = curve_json(*c.loading);
  if (c.unloading) lines["unloading"] = curve_json(*c.unloading);
  const ForceVerdict verdict = verdict_of(o);
  const std::optional<FolderError> whole = left_out_folders(o);
  Json value = {
      {"sensor", sensor_file},
      {"fit_for_use", verdict.fit_for_use},
      {"shapes_judged", verdict.shapes_judged},
      {"verdict", verdict.line},
      {"interval_95_share_of_full_scale", verdict.interval_fraction},
      {"presses", verdict.presses},
      {"recordings", to_json(o.recordings)},
      {"touched_frames", o.samples.size()},
      {"used_frames", c.readings},
      {"left_out", left_out},
      {"blocks", c.blocks},
      {"blocks_are", c.blocks_are},
      {"candidates", scores},
      {"signal", to_string(f.signal)},
      {"model", to_string(f.model)},
      {"branches", f.loading.has_value()},
      {"r_squared", f.r_squared},
      {"residual_rms_N", c.residual_rms_N},
      {"largest_residual_N", c.largest_residual_N},
      {"held_out_rms_N", c.held_out_rms_N},
      {"held_out_error_N", c.chosen.error_N},
      {"folders_left_out_error_N", whole ? Json(whole->error_N) : Json(nullptr)},
      {"interval_95_full_scale_N", c.interval_full_N},
      {"interval_95_coverage", c.interval_coverage},
      {"signal_min", f.gray_min},
      {"signal_max", f.gray_max},
      {"force_max_N", f.force_max_N},
      {"hysteresis", c.has_hysteresis ? Json(f.hysteresis) : Json(nullptr)},
      {"drift_N_per_min", std::isfinite(c.drift_sd_N_per_min) ? Json(f.drift_N_per_min) : Json(nullptr)},
      {"drift_sd_N_per_min", or_null(c.drift_sd_N_per_min)},
      {"lines", lines},
      {"checks", checks}};
  if (const std::optional<ThicknessChoice>& t = o.thickness)
    value["thickness"] = {{"decided", t->decided},
                          {"factor", t->factor},
                          {"relative_sd", t->relative_sd},
                          {"held_out_error_N", t->error_N},
                          {"held_out_error_by_modulus_alone_N", t->stated_error_N}};
  return value;
}

std::string samples_csv(const ForceOutcome& o) {
  std::string text =
      "recording,frame,time_s,press,gray_sum,area_px,volume_mm3,gradient_sum,layer_N,bending_mm,force_N,"
      "fitted_N,held_out_N,unloading,left_out\n";
  const auto cell = [](double value, const char* format) {
    return std::isfinite(value) ? palpate::text(format, value) : std::string();
  };
  for (size_t i = 0; i < o.samples.size(); ++i) {
    const ForceSample& s = o.samples[i];
    const double w = o.choice.unloading_fraction[i];
    text += palpate::text("%u,%llu,", s.recording, static_cast<unsigned long long>(s.frame)) +
            cell(s.time_s, "%.6f") +
            palpate::text(",%u,%.2f,%.0f,", s.press, s.features.gray_sum, s.features.area_px) +
            (s.features.has_volume ? palpate::text("%.6g", s.features.volume_mm3) : "") + "," +
            (s.features.has_gradient ? palpate::text("%.2f", s.features.gradient_sum) : "") + "," +
            (s.features.has_layer ? palpate::text("%.6g", s.features.layer_N) : "") + "," +
            (s.features.has_bending ? palpate::text("%.6g", s.features.bending_mm) : "") + "," +
            cell(s.force_N, "%.6g") + "," +
            palpate::text("%.6g,", force_of(o.choice.calibration, s.features, w).value) +
            cell(o.choice.held_out_N[i], "%.6g") + palpate::text(",%.3f,%s\n", w, to_string(s.left_out));
  }
  return text;
}

}  // namespace palpate
