#include "perf/lab/study/modulus_trials.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>

#include "capture/run/modulus/modulus_frames.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"

namespace palpate::perf {
namespace {

constexpr double kPadSd = 0.01, kForceSd = 0.01, kZero_mm = 0.1, kStage_mm = 0.005;

Pad trial_pad(const ModulusBench& bench) {
  return {{SyntheticOptions{}.pad_young_MPa, 0.5}, bench.pad_thickness_mm, Base::Bonded};
}

}  // namespace

std::vector<ModulusTrial> modulus_trial(gpu::Context& context, SampleShape shape, double young_MPa,
                                        const std::vector<double>& forces_N, uint64_t seed, int nodes,
                                        const ModulusBench& bench) {
  std::mt19937_64 random(seed * 7919 + static_cast<uint64_t>(shape));
  std::normal_distribution<double> normal;
  ModulusScene scene;
  scene.sample = usual_sample(shape);
  scene.young_MPa = young_MPa;
  scene.forces_N = forces_N;
  scene.sensor.seed = seed;
  scene.sensor.pad_thickness_mm = bench.pad_thickness_mm;
  scene.brightness = bench.brightness;
  scene.pad_error = kPadSd * normal(random);
  scene.size_error = scene.sample.relative_size_sd * normal(random);
  scene.zero_error_mm = kZero_mm * normal(random);
  scene.stage_sd_mm = kStage_mm;
  Sample true_sample = scene.sample;
  true_sample.size_mm *= 1 + scene.size_error;
  const PressTruth truth(trial_pad(bench), true_sample, nodes);
  const SimulatedPresses presses = simulate_presses(scene, &truth);

  ModulusSetup setup;
  setup.pad = trial_pad(bench);
  setup.sample = scene.sample;
  setup.pad_relative_sd = kPadSd;
  setup.force_relative_sd = kForceSd;
  setup.seed = seed;
  SampleReader reader(context, presses.sensor, presses.background, setup.sample);
  setup.depth_by_pressure = reader.depth_by_pressure();
  std::vector<PressFrame> staged, blind;
  for (size_t i = 0; i < presses.frames.size(); ++i) {
    std::optional<PressFrame> p = reader.read(presses.frames[i]);
    if (!p) continue;
    blind.push_back(*p);
    p->approach_mm = {presses.approach_mm[i], kStage_mm};
    staged.push_back(*p);
  }
  const PressModel model(setup.pad, setup.sample);
  return {{shape, true, young_MPa, forces_N.back(), estimate_modulus(staged, setup, model)},
          {shape, false, young_MPa, forces_N.back(), estimate_modulus(blind, setup, model)}};
}

std::vector<ModulusTrial> modulus_trial(gpu::Context& context, SampleShape shape, double young_MPa,
                                        uint64_t seed, int presses, int nodes, const ModulusBench& bench) {
  const Pad pad = trial_pad(bench);
  const PressModel model(pad, usual_sample(shape));
  const double most = usual_force_N(model, young_MPa, pad.material.young_MPa);
  std::vector<double> forces;
  forces.reserve(static_cast<size_t>(presses));
  for (int i = 0; i < presses; ++i) forces.push_back(most * (0.2 + 0.8 * i / (presses - 1)));
  return modulus_trial(context, shape, young_MPa, forces, seed, nodes, bench);
}

ModulusScore score(const std::vector<ModulusTrial>& trials, double from_MPa, double to_MPa) {
  ModulusScore s;
  std::vector<double> errors;
  for (const ModulusTrial& t : trials) {
    if (t.truth_MPa < from_MPa * 0.999 || t.truth_MPa > to_MPa * 1.001) continue;
    ++s.trials;
    if (t.answer.best().state == ModulusState::PadLimited) {
      ++s.bounds;
      s.bounds_hold += t.answer.best().low_MPa <= t.truth_MPa;
    }
    if (!t.valid()) continue;
    ++s.valid;
    s.inside += t.inside();
    errors.push_back(std::abs(t.error()));
  }
  std::sort(errors.begin(), errors.end());
  const auto quantile = [&](double q) {
    if (errors.empty()) return std::nan("");
    const double at = q * static_cast<double>(errors.size() - 1);
    const auto i = static_cast<size_t>(at);
    const double next = errors[std::min(i + 1, errors.size() - 1)];
    return errors[i] + (at - static_cast<double>(i)) * (next - errors[i]);
  };
  s.median = quantile(0.5);
  s.ninety = quantile(0.9);
  return s;
}

std::string trials_csv(const std::vector<ModulusTrial>& trials) {
  std::string csv =
      "shape,stage,truth_kPa,force_max_N,chosen,state,young_kPa,low_kPa,high_kPa,error,inside,residual_sd";
  for (size_t i = 0; i < kModulusMethods; ++i)
    csv += text(",%s kPa", to_string(static_cast<ModulusMethod>(i)));
  csv += "\n";
  for (const ModulusTrial& t : trials) {
    const ModulusEstimate& e = t.answer.best();
    csv += text("%s,%d,%.6g,%.4g,%s,%s,", to_string(t.shape), t.stage, 1e3 * t.truth_MPa, t.force_max_N,
                to_string(t.answer.chosen), to_string(e.state));
    csv += t.valid() ? text("%.5g", 1e3 * e.young_MPa) : "";
    csv += e.low_MPa > 0 ? text(",%.5g", 1e3 * e.low_MPa) : ",";
    csv += e.low_MPa > 0 && std::isfinite(e.high_MPa) ? text(",%.5g", 1e3 * e.high_MPa) : ",";
    csv += t.valid() ? text(",%.4f,%d", t.error(), t.inside()) : ",,";
    csv += text(",%.3f", e.residual);
    for (const ModulusEstimate& w : t.answer.methods)
      csv += w.state == ModulusState::Valid ? text(",%.5g", 1e3 * w.young_MPa) : ",";
    csv += "\n";
  }
  return csv;
}

std::string scores_text(const std::vector<ModulusTrial>& trials) {
  std::string out = text("%-9s %-14s %-16s %6s %6s %8s %8s %8s   %s\n", "shape", "stage", "range, kPa",
                         "trials", "valid", "median", "90th", "inside", "bounds that hold");
  const auto row = [&](const char* shape, const char* stage, const std::vector<ModulusTrial>& of) {
    for (const auto& [from, to] : {std::pair{0.01, 1.0}, std::pair{0.005, 5.0}}) {
      const ModulusScore s = score(of, from, to);
      out += text("%-9s %-14s %5g to %-7g %6zu %6zu %6.1f %% %6.1f %% %6.1f %%   %zu of %zu\n", shape, stage,
                  1e3 * from, 1e3 * to, s.trials, s.valid, 100 * s.median, 100 * s.ninety,
                  s.valid ? 100.0 * static_cast<double>(s.inside) / static_cast<double>(s.valid) : 0.0,
                  s.bounds_hold, s.bounds);
    }
  };
  for (const bool stage : {true, false}) {
    const char* word = stage ? "known" : "not known";
    std::vector<ModulusTrial> all;
    for (const SampleShape shape : {SampleShape::Cube, SampleShape::Cylinder, SampleShape::Sphere}) {
      std::vector<ModulusTrial> some;
      for (const ModulusTrial& t : trials)
        if (t.shape == shape && t.stage == stage) some.push_back(t);
      all.insert(all.end(), some.begin(), some.end());
      row(to_string(shape), word, some);
    }
    row("all", word, all);
  }
  row("all", "both", trials);
  return out;
}

Plot trials_plot(const std::vector<ModulusTrial>& trials) {
  Plot plot{.across = 2, .width_px = 1160, .height_px = 520};
  for (const bool stage : {true, false}) {
    PlotPanel panel{stage ? "stage beside the camera" : "stage not known: camera alone", "true modulus, kPa",
                    "estimate and 95 % interval, kPa"};
    panel.log_x = panel.log_y = true;
    panel.x_range = {{4, 7000}};
    panel.y_range = {{3, 9000}};
    panel.key = "top left";
    panel.add("truth", {4, 7000}, {4, 7000}, 4).width = 1.5;
    for (const SampleShape shape : {SampleShape::Cube, SampleShape::Cylinder, SampleShape::Sphere}) {
      const size_t colour = panel.curves.size() - 1;
      PlotCurve& curve = panel.add(to_string(shape), {}, {}, colour, PlotCurve::Style::Points);
      for (const ModulusTrial& t : trials) {
        if (t.shape != shape || t.stage != stage || !t.valid()) continue;
        // Side by side, not one upon the other.
        curve.add(1e3 * t.truth_MPa * (1 + 0.06 * (static_cast<double>(colour) - 1)),
                  1e3 * t.answer.best().young_MPa, 1e3 * t.answer.best().low_MPa,
                  1e3 * t.answer.best().high_MPa);
      }
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

}  // namespace palpate::perf
