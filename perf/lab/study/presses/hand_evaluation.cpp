#include "perf/lab/study/presses/hand_evaluation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/observation/scan_stitch.h"
#include "engine/palpation/hand/hand_scan.h"
#include "engine/palpation/hand/hand_simulation.h"
#include "engine/palpation/scan.h"
#include "palpate/error.h"
#include "perf/lab/study/judged_by_team.h"
#include "perf/lab/study/presses/staged_presses.h"

namespace palpate::lump {
namespace {

struct One {
  std::optional<Estimate> staged, hand;  ///< none: refused
  size_t presses = 0, staged_presses = 0, staged_used = 0, used = 0;
};

Estimate estimate_of(const std::vector<ScanPress>& presses, const StitchOptions& options,
                     const Estimator& estimator, size_t& used) {
  const ScanMap map = stitch(presses, options);
  used = static_cast<size_t>(
      std::count_if(map.places.begin(), map.places.end(), [](const PressPlace& p) { return p.used; }));
  return estimate_map(map, presses, options, estimator);
}

One judge(const Example& example, const EvaluationJob& job, const Estimator& estimator, const Model& model,
          uint64_t seed) {
  const PressedTissue tissue = tissue_of(example, kHardest_N);
  HandPlan plan;
  plan.sensor.noise_fraction = job.sensor.noise_fraction;
  plan.seed = seed;
  const std::vector<HandPress> presses = simulate_hand(tissue, plan);
  One one;
  one.presses = presses.size();
  PalpationSensor sensor = HandPlan{}.sensor;
  sensor.noise_fraction = job.sensor.noise_fraction;
  const auto staged = staged_presses(tissue, scan_places(tissue.block_mm, sensor.window_mm),
                                     presses[0].observation.force_N.back(), sensor, seed);
  one.staged_presses = staged.size();
  StitchOptions stage;
  stage.stage_sd_mm = kStudyStage_mm;
  one.staged = estimate_of(staged, stage, estimator, one.staged_used);
  try {
    // The first press lies as far off its aim as is stated.
    HandScanOptions options;
    options.places.first_sd_mm = plan.first_sd_mm;
    const HandScan scan = hand_scan(presses, model, options);
    one.hand = estimate_of(scan.presses, scan.stitch, estimator, one.used);
  } catch (const Error& error) {
    if (error.failure() != Failure::Input) throw;
  }
  return one;
}

HandRow row_of(const char* name, const std::vector<Example>& examples, const std::vector<One>& all,
               std::optional<Estimate> One::*which, size_t One::*presses, size_t One::*used) {
  HandRow row;
  row.scan = name;
  std::array<std::vector<double>, 3> errors;
  std::array<size_t, 3> held{};
  size_t judged = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    const Example& truth = examples[i];
    const std::optional<Estimate>& e = all[i].*which;
    (truth.lump ? row.lumps : row.plain) += 1;
    row.presses += static_cast<double>(all[i].*presses) / static_cast<double>(all.size());
    row.used += static_cast<double>(all[i].*used) / static_cast<double>(all.size());
    const bool numbers = e && reports_numbers(e->verdict);
    row.refused += !e;
    if (!truth.lump) {
      row.false_lumps += numbers;
      continue;
    }
    const bool staged = all[i].staged && reports_numbers(all[i].staged->verdict);
    row.staged_found += staged;
    row.found += numbers;
    row.also_found += staged && numbers;
    row.detected += e && e->detection_statistic >= 1;
    if (!numbers) continue;
    ++judged;
    const auto values = values_of(*e);
    const auto truths = truth_of(truth);
    for (size_t p = 0; p < 3; ++p) {
      held[p] += truths[p] >= values[p].low && truths[p] <= values[p].high;
      if (p < 2 || (truths[p] >= 2 && truths[p] <= 20))
        errors[p].push_back(std::abs(values[p].value / truths[p] - 1));
    }
  }
  for (size_t p = 0; p < 3; ++p) {
    row.median_error[p] = errors[p].empty() ? kNaN : median(errors[p]);
    row.hold[p] = judged > 0 ? static_cast<double>(held[p]) / static_cast<double>(judged) : kNaN;
  }
  return row;
}

}  // namespace

std::vector<HandRow> judge_by_hand(const std::vector<Example>& examples, const EvaluationJob& job,
                                   const std::string& method) {
  const auto network = load_network("");
  ErrorSources place = ErrorSources::none();
  place.place = true;
  const Estimator estimator = named_estimator(method, network, place);
  const size_t count = count_judged(examples.size(), job);
  std::vector<Example> chosen;
  for (size_t n = 0; n < count; ++n) chosen.push_back(examples[job.first + n / job.repeats * job.every]);
  const auto judged = judged_by_team(count, job.threads, job.progress, [&](size_t n) {
    return std::pair{n, judge(chosen[n], job, estimator, network->model(), job.seed * 100003 + n)};
  });
  std::vector<Example> truth;
  std::vector<One> all;
  for (const auto& [n, one] : judged) {
    truth.push_back(chosen[n]);
    all.push_back(one);
  }
  return {row_of("staged", truth, all, &One::staged, &One::staged_presses, &One::staged_used),
          row_of("by hand", truth, all, &One::hand, &One::presses, &One::used)};
}

std::string hand_text(const std::vector<HandRow>& rows) {
  std::string words;
  for (const HandRow& r : rows)
    words += text(
        "%s: %zu blocks with a lump, %zu without; presses used %.1f of %.1f, scans refused %zu\n"
        "  lumps with numbers %zu, detected %zu; where the staged scan has numbers: %zu of %zu; false lumps "
        "%zu\n"
        "  median errors of size, depth, ratio %.1f, %.1f, %.1f %%; intervals hold %.0f, %.0f, %.0f %%\n",
        r.scan.c_str(), r.lumps, r.plain, r.used, r.presses, r.refused, r.found, r.detected, r.also_found,
        r.staged_found, r.false_lumps, 100 * r.median_error[0], 100 * r.median_error[1],
        100 * r.median_error[2], 100 * r.hold[0], 100 * r.hold[1], 100 * r.hold[2]);
  return words;
}

std::string hand_csv(const std::vector<HandRow>& rows) {
  std::string csv =
      "scan,lumps,plain,presses,used,refused,found,detected,staged_found,also_found,false_lumps,"
      "size_error,depth_error,ratio_error,size_hold,depth_hold,ratio_hold\n";
  for (const HandRow& r : rows)
    csv += text("%s,%zu,%zu,%.4g,%.4g,%zu,%zu,%zu,%zu,%zu,%zu,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g\n",
                r.scan.c_str(), r.lumps, r.plain, r.presses, r.used, r.refused, r.found, r.detected,
                r.staged_found, r.also_found, r.false_lumps, r.median_error[0], r.median_error[1],
                r.median_error[2], r.hold[0], r.hold[1], r.hold[2]);
  return csv;
}

json::Value hand_json(const std::vector<HandRow>& rows) {
  json::Value all = json::Value::array();
  for (const HandRow& r : rows)
    all.push_back({{"scan", r.scan},
                   {"lumps", r.lumps},
                   {"plain", r.plain},
                   {"presses", r.presses},
                   {"used", r.used},
                   {"refused", r.refused},
                   {"found", r.found},
                   {"detected", r.detected},
                   {"staged_found", r.staged_found},
                   {"also_found", r.also_found},
                   {"false_lumps", r.false_lumps},
                   {"median_error", r.median_error},
                   {"hold", r.hold}});
  return all;
}

}  // namespace palpate::lump
