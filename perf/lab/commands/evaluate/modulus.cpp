// palpate-lab evaluate modulus: simulated samples of known Young's modulus; do the intervals hold it?
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "perf/lab/study/modulus_trials.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kWrongFraction = 0.2;
constexpr double kSoftest_MPa = 0.005, kStiffest_MPa = 5, kThinnest_mm = 3, kThickest_mm = 10,
                 kDarkest = 0.04, kBrightest = 0.8;
constexpr int kPresses = 6, kNodes = 50;
constexpr std::array kShapes = {SampleShape::Cube, SampleShape::Cylinder, SampleShape::Sphere};

struct Options {
  uint32_t trials = 200;
  judge::CellOptions cells;
};

judge::JudgedCase case_of(const perf::ModulusTrial& trial) {
  const ModulusEstimate& e = trial.answer.best();
  judge::JudgedCase one;
  const double truth = 1e3 * trial.truth_MPa;
  one.reported = trial.valid();
  judge::JudgedValue v{truth, kNaN, kNaN, kNaN};
  if (one.reported) v = {truth, 1e3 * e.young_MPa, 1e3 * e.low_MPa, 1e3 * e.high_MPa};
  one.wrong = one.reported && !trial.inside() && std::abs(trial.error()) > kWrongFraction;
  one.values = {v};
  return one;
}

/// Both with stage and camera, and by the camera alone; the two err together.
void add_sample(gpu::Context& context, uint64_t seed, size_t group, judge::Cases& cases) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> even;
  const auto between = [&](double low, double high) { return low * std::pow(high / low, even(random)); };
  const double young_MPa = between(kSoftest_MPa, kStiffest_MPa);
  const size_t shape = random() % kShapes.size();
  const perf::ModulusBench bench{between(kThinnest_mm, kThickest_mm), between(kDarkest, kBrightest)};
  for (const perf::ModulusTrial& trial :
       perf::modulus_trial(context, kShapes[shape], young_MPa, random() >> 16, kPresses, kNodes, bench)) {
    judge::JudgedCase one = case_of(trial);
    one.conditions = {1e3 * young_MPa, bench.pad_thickness_mm, 100 * bench.brightness,
                      static_cast<double>(shape), trial.stage ? 0.0 : 1.0};
    one.group = group;
    cases.cases.push_back(std::move(one));
  }
}

Report run(const Common& common, const Options& o) {
  const std::unique_ptr<gpu::Context> context = open_device(common);
  judge::Cases cases;
  cases.conditions = {
      {"young_kPa", {}}, {"pad_mm", {}}, {"peak_percent", {}}, {"shape", {}}, {"stage", {"known", "none"}}};
  for (const SampleShape shape : kShapes) cases.conditions[3].labels.emplace_back(to_string(shape));
  cases.quantities = {{"young_kPa", 0.95}};
  cases.wrong_means = text("more than %g %% off and outside the interval", 100 * kWrongFraction);
  ProgressBar bar(common, "pressing", o.trials);
  uint32_t done = 0;
  for (; done < o.trials && !interrupted(); ++done) {
    add_sample(*context, common.seed * 1000003 + done, 1 + done, cases);
    bar.update(done + 1);
  }
  Report report = judged_report(common, cases, o.cells, "modulus", done, o.trials);
  if (!validation_clean(*context)) report.exit_code = kInternalError;
  return report;
}

}  // namespace

void add_evaluate_modulus(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("modulus", "Samples of known Young's modulus: do the 95 % intervals contain it?");
  auto o = std::make_shared<Options>();
  o->cells.by = {"young_kPa", "pad_mm", "peak_percent", "stage"};
  add_trials(*command, o->trials, "Samples, each pressed six times; 1 to 2 s each");
  add_cell_options(*command, o->cells,
                   "young_kPa (5 to 5000), pad_mm (its thickness, 3 to 10), peak_percent (brightest pixel of "
                   "full scale, 4 to 80: less is more noise), shape, stage (known, none)");
  command->add_option("--out", common.out, "Folder for modulus.txt, .csv, .json and plots");
  add_common(
      *command, common,
      "  palpate-lab evaluate modulus --trials 200 --out out/modulus\n"
      "  palpate-lab evaluate modulus --by young_kPa,shape --seed 7 --json\n"
      "Finite elements of pad and sample seen through the simulated waveguide; pad, size and stage\n"
      "are off by errors that are stated to the fit. Estimates that are not valid count as refused.\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
