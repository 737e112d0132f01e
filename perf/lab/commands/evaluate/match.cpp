// palpate-lab evaluate match: bent point sets with known partners; is what is called reliable true?
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "capture/synthetic/bent_points.h"
#include "engine/base/text.h"
#include "perf/lab/commands/evaluate/evaluate.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kWorstMiss = 0.05;       // mean distance to the truth, of the template's size
constexpr double kUnrelatedShare = 0.1;   // of the trials: targets that are not the template
constexpr size_t kUnrelatedPoints = 105;  // as many as the template has

struct Options {
  uint32_t trials = 600;
  uint32_t axes = 2;
  judge::CellOptions cells;
};

/// Steps of what varies; the first in half of the trials.
struct Levels {
  const char* name;
  std::array<double, 4> values;
};
constexpr std::array<Levels, 5> kLevels = {{{"bend", {0.03, 0.05, 0.08, 0.11}},
                                            {"noise", {0, 0.01, 0.03, 0.05}},
                                            {"strangers", {0, 0.5, 1, 2}},
                                            {"missing", {0, 0.1, 0.2, 0.33}},
                                            {"turn_deg", {0, 30, 90, 160}}}};

double draw(const Levels& levels, std::mt19937_64& random) {
  const auto even = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  return levels.values[even() < 0.5 ? 0 : 1 + static_cast<size_t>(3 * even())];
}

judge::JudgedCase bent_case(uint32_t axes, std::mt19937_64& random) {
  judge::JudgedCase one;
  for (const Levels& levels : kLevels) one.conditions.push_back(draw(levels, random));
  const auto& c = one.conditions;
  const BentPoints points = bent({.axes = axes,
                                  .bend = c[0],
                                  .noise_sd = c[1],
                                  .outlier_ratio = c[2],
                                  .missing_fraction = c[3],
                                  .turn_deg = random() % 2 ? c[4] : -c[4],
                                  .seed = static_cast<uint32_t>(random())});
  const MatchResult result = match_points(points.from, points.to);
  one.reported = result.reliable();
  one.wrong = !(mean_miss(result.warped, points.truth) <= kWorstMiss);
  return one;
}

/// Points at random in the template's square: whatever is called reliable is wrong.
judge::JudgedCase unrelated_case(uint32_t axes, std::mt19937_64& random) {
  PointSet target{axes, {}};
  for (size_t i = 0; i < kUnrelatedPoints * axes; ++i)
    target.coordinates.push_back(static_cast<double>(random() >> 11) * 0x1p-53);
  judge::JudgedCase one{std::vector<double>(kLevels.size(), kNaN), {}};
  one.reported = match_points(character(axes), target).reliable();
  one.wrong = true;
  return one;
}

Report run(const Common& common, const Options& o) {
  judge::Cases cases;
  for (const Levels& levels : kLevels) cases.conditions.push_back({levels.name, {}});
  cases.wrong_means = text("farther than %g of the size on average", kWorstMiss);
  ProgressBar bar(common, "matching", o.trials);
  for (uint32_t trial = 0; trial < o.trials && !interrupted(); ++trial) {
    std::mt19937_64 random(common.seed * 1000003 + trial);
    const bool unrelated = static_cast<double>(random() >> 11) * 0x1p-53 < kUnrelatedShare;
    cases.cases.push_back(unrelated ? unrelated_case(o.axes, random) : bent_case(o.axes, random));
    bar.update(trial + 1);
  }
  return judged_report(common, cases, o.cells, "match", cases.cases.size(), o.trials);
}

}  // namespace

void add_evaluate_match(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "match", "Point sets with known partners: are matches that are called reliable right?");
  auto o = std::make_shared<Options>();
  add_trials(*command, o->trials, "Pairs of point sets; one of ten has a target that is not the template");
  command->add_setting("--axes", o->axes, Check::one_of({2, 3}), "2: in the plane; 3: in space");
  add_cell_options(*command, o->cells, "bend, noise, strangers, missing, turn_deg");
  command->add_option("--out", common.out, "Folder for match.txt, .csv, .json and plots");
  add_common(*command, common,
             "  palpate-lab evaluate match --trials 600 --out out/match\n"
             "  palpate-lab evaluate match --by noise,strangers --seed 7 --json\n"
             "A match is wrong where its points lie farther than 0.05 of the template's size from the truth\n"
             "on average. Half of the trials have the first step of a condition, the others one of three.\n");
  command->runs(chosen, [o, &common] { return run(common, *o); });
}

}  // namespace palpate
