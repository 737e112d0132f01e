// palpate-lab evaluate force: forces of the simulated sensor, calibrated on some objects and judged on
// others.
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "capture/calibrate/force/force.h"
#include "capture/synthetic/synthetic.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"

namespace palpate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kWrongFraction = 0.1, kInterval = 1.96;
constexpr uint32_t kWidth_px = 320, kHeight_px = 240;
constexpr double kRate_Hz = 5;
constexpr double kSmallest_mm = 3, kLargest_mm = 15, kFlattest_mm = 4, kLeast_N = 0.6, kMost_N = 2;
constexpr size_t kManyObjects = 3;

struct Options {
  uint32_t trials = 80;
  uint32_t readings = 10;
  judge::CellOptions cells;
};

double between(double low, double high, std::mt19937_64& random) {
  return low * std::pow(high / low, static_cast<double>(random() >> 11) * 0x1p-53);
}

/// A ball, or the flat end of a cylinder, that presses at several places.
SyntheticOptions object(SyntheticMode mode, bool flat, std::mt19937_64& random) {
  SyntheticOptions o;
  o.scene = flat ? "flat" : "palpation";
  o.width = kWidth_px;
  o.height = kHeight_px;
  o.mode = mode;
  o.rate_Hz = kRate_Hz;
  o.indenter_radius_mm =
      flat ? between(1.5, kFlattest_mm, random) : between(kSmallest_mm, kLargest_mm, random);
  o.force_N = between(kLeast_N, kMost_N, random);
  o.seed = 1 + random() % 1000000;
  return o;
}

Outputs outputs_of(const Sensor& sensor) {
  Outputs outputs = Output::Force;
  if (may_show_slopes(sensor)) outputs |= Output::Gradient;
  return outputs;
}

ForceCalibration calibration_on(gpu::Context& context, SyntheticMode mode, size_t objects,
                                std::mt19937_64& random, const RunWatch& watch) {
  std::vector<GaugedRecording> recordings;
  for (size_t i = 0; i < objects; ++i) {
    const SyntheticOptions options = object(mode, false, random);
    MeasuredInput input{to_string(options), synthetic_sensor(options), std::nullopt, {}};
    input.outputs = outputs_of(input.sensor);
    recordings.push_back(measure_with_gauge(context, input, {"truth", {}, {}, 0}, watch));
  }
  return calibrate_force(std::move(recordings), {}).choice.calibration;
}

/// One frame of another object while it touches, by a pipeline that knows no force.
judge::JudgedCase reading_of(Pipeline& pipeline, SyntheticMode mode, const ForceCalibration& calibration,
                             std::mt19937_64& random) {
  const bool flat = random() % 4 == 0;
  const SyntheticOptions options = object(mode, flat, random);
  const SyntheticSensor source(options);
  const uint64_t frames = source.frame_count().value();
  uint64_t sequence = random() % frames;
  while (!source.truth(sequence)->contact) sequence = random() % frames;
  Frame frame;
  source.render(sequence, frame);
  pipeline.set_background(*source.own_background());
  const Touch touch = pipeline.process(frame).touch;
  const double truth_N = source.truth(sequence)->force_N;
  const Estimate force = force_of(calibration, force_features(touch));
  judge::JudgedCase one;
  one.conditions = {truth_N, options.indenter_radius_mm, flat ? 1.0 : 0.0};
  one.reported = force.validity == Validity::Valid;
  const double half_N = kInterval * force.standard_error, error_N = std::abs(force.value - truth_N);
  judge::JudgedValue v{truth_N, kNaN, kNaN, kNaN};
  if (one.reported) v = {truth_N, force.value, force.value - half_N, force.value + half_N};
  one.wrong = one.reported && error_N > half_N && error_N > kWrongFraction * calibration.force_max_N;
  one.values = {v};
  return one;
}

std::vector<judge::JudgedCase> trial_of(gpu::Context& context, uint64_t seed, uint32_t readings,
                                        const RunWatch& watch) {
  std::mt19937_64 random(seed);
  const SyntheticMode mode = random() % 2 ? SyntheticMode::Gel : SyntheticMode::Waveguide;
  const bool many = random() % 2;
  const ForceCalibration calibration = calibration_on(context, mode, many ? kManyObjects : 1, random, watch);
  std::vector<judge::JudgedCase> cases;
  if (watch.stopped()) return cases;
  SyntheticOptions bare;
  bare.mode = mode, bare.width = kWidth_px, bare.height = kHeight_px;
  Sensor sensor = synthetic_sensor(bare);
  sensor.force.reset();
  Pipeline pipeline(context, sensor, SyntheticSensor(bare).format(), {.outputs = outputs_of(sensor)});
  for (uint32_t i = 0; i < readings; ++i) {
    cases.push_back(reading_of(pipeline, mode, calibration, random));
    cases.back().conditions.push_back((mode == SyntheticMode::Gel ? 2.0 : 0.0) + (many ? 1.0 : 0.0));
  }
  return cases;
}

Report run(const Common& common, const Options& o) {
  const std::unique_ptr<gpu::Context> context = open_device(common);
  judge::Cases cases;
  cases.conditions = {{"force_N", {}},
                      {"radius_mm", {}},
                      {"shape", {"ball", "flat"}},
                      {"calibrated", {"pad, 1 ball", "pad, 3 balls", "gel, 1 ball", "gel, 3 balls"}}};
  cases.quantities = {{"force_N", 0.95}};
  cases.wrong_means =
      text("off by more than %g %% of full scale and outside the interval", 100 * kWrongFraction);
  RunWatch watch;
  watch.stop = interrupted;
  ProgressBar bar(common, "calibrating", o.trials);
  uint32_t done = 0;
  for (; done < o.trials && !interrupted(); ++done) {
    std::vector<judge::JudgedCase> more = trial_of(*context, common.seed * 1000003 + done, o.readings, watch);
    if (more.empty()) break;
    for (judge::JudgedCase& one : more) {
      one.group = 1 + done;
      cases.cases.push_back(std::move(one));
    }
    bar.update(done + 1);
  }
  Report report = judged_report(common, cases, o.cells, "force", done, o.trials);
  if (!validation_clean(*context)) report.exit_code = kInternalError;
  return report;
}

}  // namespace

void add_evaluate_force(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "force", "Force calibrated on some objects, checked on others: do the 95 % intervals contain it?");
  auto o = std::make_shared<Options>();
  add_trials(*command, o->trials, "Calibrations, of the simulated pad or gel, each on one ball or three");
  command->add_setting("--readings", o->readings, Check::range(1, 1000),
                       "Of each, each of another ball or flat end, force and place");
  add_cell_options(*command, o->cells,
                   "force_N, radius_mm (of a ball, 3 to 15, or a flat end, 1.5 to 4), shape, calibrated "
                   "(pad or gel, on 1 ball or 3)");
  command->add_option("--out", common.out, "Folder for force.txt, .csv, .json and plots");
  add_common(*command, common,
             "  palpate-lab evaluate force --trials 80 --out out/force\n"
             "  palpate-lab evaluate force --by force_N,calibrated --seed 7 --json\n"
             "Calibrated as palpate calibrate force does it without its options, of gray sum, gradients and\n"
             "area. Refused is what has another state than valid.\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
