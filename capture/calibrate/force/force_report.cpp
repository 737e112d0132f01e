// Report of a force calibration: text, JSON and points.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "capture/calibrate/force/force.h"
#include "engine/base/text.h"

namespace palpate {
namespace {

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

/// Recordings that the errors were judged on, for people.
std::string judged_on(const ForceChoice& c) {
  if (c.days_left_out) return "objects and days (folders) that the fits had not seen";
  if (c.objects_left_out) return "objects that the fits had not seen, on days (folders) that they had";
  return "objects that the fits had seen: others may read differently";
}

/// What reads the presses better than what was taken, but may not be taken unasked; empty: nothing.
std::string better_but(const ForceChoice& c) {
  const CandidateScore* best = nullptr;
  for (const CandidateScore& s : c.scores)
    if (s.refused.empty() && !s.eligible && s.error_N < (best ? best->error_N : c.chosen.error_N)) best = &s;
  if (!best) return "";
  return palpate::text(
      "note: %s reads these better (%.3g N), but goes with %s, which these recordings do not judge: "
      "--signal %s takes it\n",
      to_string(best->candidate).c_str(), best->error_N,
      c.objects_left_out ? "the light, which changes from day to day" : "the object's shape",
      std::ranges::find(kForceSignalNames, best->candidate.signal, [](auto& n) {
        return n.second;
      })->first.c_str());
}

}  // namespace

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
  text += palpate::text("\n\nheld out: %zu blocks of %s, one after the other; judged on %s\n", c.blocks,
                        c.blocks_are, judged_on(c).c_str());
  text += "curve                              error, N   worse than the best, N\n";
  for (const CandidateScore& s : c.scores) {
    const std::string name = to_string(s.candidate);
    const ForceCandidate &a = s.candidate, &b = c.chosen.candidate;
    const bool chosen = a.signal == b.signal && a.model == b.model && a.branches == b.branches;
    if (!s.refused.empty())
      text += palpate::text("%-32s          -   not fitted: %.200s\n", name.c_str(), s.refused.c_str());
    else
      text +=
          palpate::text("%-32s %10.4g   %.3g +- %.2g%s\n", name.c_str(), s.error_N, s.worse_N, s.worse_sd_N,
                        chosen                         ? "   <- chosen: the simplest within a standard error"
                        : !s.eligible && s.worse_N < 0 ? "   (only with --signal)"
                                                       : "");
  }
  text += better_but(c) + "\n" + curve_text(f) + "\n";
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
      {"objects_left_out", c.objects_left_out},
      {"days_left_out", c.days_left_out},
      {"candidates", scores},
      {"signal", to_string(f.signal)},
      {"model", to_string(f.model)},
      {"branches", f.loading.has_value()},
      {"r_squared", f.r_squared},
      {"residual_rms_N", c.residual_rms_N},
      {"largest_residual_N", c.largest_residual_N},
      {"held_out_rms_N", c.held_out_rms_N},
      {"held_out_error_N", c.chosen.error_N},
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
