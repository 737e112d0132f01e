#include "perf/lab/study/presses/next_press_evaluation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/palpation/next_press.h"
#include "engine/palpation/scan.h"
#include "perf/lab/study/judged_by_team.h"
#include "perf/lab/study/presses/staged_presses.h"

namespace palpate::lump {
namespace {

constexpr double kGentle = 2.0 / 3;

ScanStep step_of(const Estimate& estimate, const Example& truth) {
  ScanStep step;
  step.numbers = reports_numbers(estimate.verdict);
  step.length = kNaN;
  if (!step.numbers || !truth.lump) return step;
  const auto values = values_of(estimate);
  const auto truths = truth_of(truth);
  double product = 1;
  for (size_t p = 0; p < 3; ++p) {
    product *= std::log(values[p].high / values[p].low);
    step.holds[p] = truths[p] >= values[p].low && truths[p] <= values[p].high;
    step.error[p] = std::abs(values[p].value / truths[p] - 1);
    if (p == 2 && !(truths[p] >= 2 && truths[p] <= 20)) step.error[p] = kNaN;
  }
  step.length = std::cbrt(product);
  return step;
}

class ScanStudy {
 public:
  ScanStudy(const Example& example, const EvaluationJob& job, const Estimator& estimator, const Model& model,
            double top_N, uint64_t seed)
      : example_(example),
        estimator_(estimator),
        model_(model),
        top_N_(top_N),
        seed_(seed),
        tissue_(tissue_of(example, kHardest_N)) {
    sensor_.window_mm = next_.window_mm;
    sensor_.noise_fraction = job.sensor.noise_fraction;
    stage_.stage_sd_mm = kStudyStage_mm;
  }

  NextPressCase run() {
    NextPressCase found;
    press_harder(found);
    found.lump = example_.lump;
    std::vector<std::array<double, 2>> places = scan_places(tissue_.block_mm, sensor_.window_mm);
    const auto presses = staged_presses(tissue_, places, top_N_, sensor_, 2 * seed_);
    for (size_t n = 1; n <= presses.size(); ++n)
      found.raster.push_back(
          step_of(estimate_of({presses.begin(), presses.begin() + static_cast<long>(n)}).second, example_));
    const size_t most = places.size();
    places = {{0, 0}};
    for (;;) {
      const auto [map, estimate] =
          estimate_of(staged_presses(tissue_, places, top_N_, sensor_, 2 * seed_ + 1));
      found.proposed.push_back(step_of(estimate, example_));
      if (places.size() == most) break;
      const auto next = next_press(model_, map, estimate, next_);
      if (!next) {
        found.stopped = places.size();
        break;
      }
      places.push_back(next->at_mm);
    }
    return found;
  }

 private:
  /// One press in the middle at two thirds of the force, then what is proposed with more.
  void press_harder(NextPressCase& found) const {
    found.harder_told = found.harder_found = kNaN;
    std::vector<std::array<double, 2>> places = {{0, 0}};
    const auto [map, estimate] =
        estimate_of(staged_presses(tissue_, places, kGentle * top_N_, sensor_, 2 * seed_ + 1));
    const auto next = next_press(model_, map, estimate, next_);
    if (!next || !(next->harder_N > 0)) return;
    places.push_back(next->at_mm);
    const double top_N = std::min(top_N_, next->harder_N);
    const ScanStep before = step_of(estimate, example_);
    // Noise is a share of the peak; a sensor's own does not grow with the force.
    PalpationSensor sensor = sensor_;
    sensor.noise_fraction *= kGentle * top_N_ / top_N;
    const ScanStep after =
        step_of(estimate_of(staged_presses(tissue_, places, top_N, sensor, 2 * seed_ + 1)).second, example_);
    if (!before.numbers || !after.numbers) return;
    found.harder_told =
        std::cbrt(next->harder_narrower[0] * next->harder_narrower[1] * next->harder_narrower[2]);
    found.harder_found = after.length / before.length;
  }

  std::pair<ScanMap, Estimate> estimate_of(const std::vector<ScanPress>& presses) const {
    ScanMap map = stitch(presses, stage_);
    Estimate estimate = estimate_map(map, presses, stage_, estimator_);
    return {std::move(map), std::move(estimate)};
  }

  const Example& example_;
  const Estimator& estimator_;
  const Model& model_;
  double top_N_;
  uint64_t seed_;
  PressedTissue tissue_;
  NextPressOptions next_;
  PalpationSensor sensor_;
  StitchOptions stage_;
};

/// After so many presses; the last step of a scan that ended earlier.
const ScanStep& at(const std::vector<ScanStep>& steps, size_t presses) {
  return steps[std::min(presses, steps.size()) - 1];
}

void add_row(const std::vector<NextPressCase>& cases, size_t presses, NextPressScore& score) {
  NextPressRow row;
  row.presses = presses;
  std::vector<double> raster, proposed;
  std::array<std::vector<double>, 3> errors[2];
  std::array<size_t, 3> held[2] = {};
  for (const NextPressCase& c : cases) {
    if (!c.lump) continue;
    const ScanStep* steps[2] = {&at(c.raster, presses), &at(c.proposed, presses)};
    const double whole = c.raster.back().length;
    row.raster_numbers += steps[0]->numbers;
    row.proposed_numbers += steps[1]->numbers;
    if (steps[0]->numbers && std::isfinite(whole)) raster.push_back(steps[0]->length / whole);
    if (steps[1]->numbers && std::isfinite(whole)) proposed.push_back(steps[1]->length / whole);
    for (size_t s = 0; s < 2; ++s)
      for (size_t p = 0; p < 3 && steps[s]->numbers; ++p) {
        held[s][p] += steps[s]->holds[p];
        if (std::isfinite(steps[s]->error[p])) errors[s][p].push_back(steps[s]->error[p]);
      }
  }
  const auto middle = [](std::vector<double>& of) { return of.empty() ? kNaN : median(of); };
  row.raster_length = middle(raster);
  row.proposed_length = middle(proposed);
  for (size_t p = 0; p < 3; ++p) {
    row.raster_error[p] = middle(errors[0][p]);
    row.proposed_error[p] = middle(errors[1][p]);
    row.raster_holds[p] = static_cast<double>(held[0][p]) / static_cast<double>(row.raster_numbers);
    row.proposed_holds[p] = static_cast<double>(held[1][p]) / static_cast<double>(row.proposed_numbers);
  }
  score.rows.push_back(row);
}

}  // namespace

std::vector<NextPressCase> judge_next_press(const std::vector<Example>& examples, const EvaluationJob& job,
                                            const std::string& method, double top_N) {
  const auto network = load_network("");
  ErrorSources place = ErrorSources::none();
  place.place = true;
  const Estimator estimator = named_estimator(method, network, place);
  return judged_by_team(count_judged(examples.size(), job), job.threads, job.progress, [&](size_t n) {
    const size_t number = job.first + n / job.repeats * job.every;
    NextPressCase found =
        ScanStudy(examples[number], job, estimator, network->model(), top_N, job.seed * 100003 + n).run();
    found.number = number;
    return found;
  });
}

NextPressScore score_next_press(const std::vector<NextPressCase>& cases) {
  NextPressScore score;
  size_t with_numbers = 0;
  std::vector<double> told, gained;
  for (const NextPressCase& c : cases) {
    score.raster_presses = c.raster.size();
    if (!c.lump) {
      ++score.plain;
      score.false_lumps += std::ranges::any_of(c.proposed, &ScanStep::numbers);
      continue;
    }
    ++score.lumps;
    score.mean_stopped += static_cast<double>(c.proposed.size());
    if (std::isfinite(c.harder_told)) {
      told.push_back(c.harder_told);
      gained.push_back(c.harder_found);
    }
    if (!c.raster.back().numbers) continue;
    ++with_numbers;
    size_t n = 0;
    while (n < c.proposed.size() && !(c.proposed[n].length <= c.raster.back().length)) ++n;
    score.reached += n < c.proposed.size();
    score.presses_to_reach += static_cast<double>(n < c.proposed.size() ? n + 1 : c.raster.size());
  }
  score.mean_stopped /= static_cast<double>(std::max<size_t>(1, score.lumps));
  score.presses_to_reach /= static_cast<double>(std::max<size_t>(1, with_numbers));
  score.harder = told.size();
  score.harder_told = told.empty() ? kNaN : median(told);
  score.harder_found = told.empty() ? kNaN : median(gained);
  for (size_t presses = 1; presses <= score.raster_presses; ++presses) add_row(cases, presses, score);
  return score;
}

std::string next_press_text(const NextPressScore& s) {
  std::string words = text(
      "%zu blocks with a lump, %zu without; a raster of %zu presses\n"
      "intervals no longer than the whole raster's: %zu lumps, after %.2f presses in the mean; nothing more "
      "worth pressing after %.2f; false lumps %zu\n"
      "%zu to be pressed harder: intervals of %.2f of their length told, %.2f found\n",
      s.lumps, s.plain, s.raster_presses, s.reached, s.presses_to_reach, s.mean_stopped, s.false_lumps,
      s.harder, s.harder_told, s.harder_found);
  for (const NextPressRow& r : s.rows)
    for (const bool raster : {true, false}) {
      const auto& error = raster ? r.raster_error : r.proposed_error;
      const auto& holds = raster ? r.raster_holds : r.proposed_holds;
      words += text(
          "%zu presses, %s: numbers %zu, length %.3g of the raster's, median errors of size, depth, ratio "
          "%.1f, %.1f, %.1f %%, intervals hold %.0f, %.0f, %.0f %%\n",
          r.presses, raster ? "raster" : "proposed", raster ? r.raster_numbers : r.proposed_numbers,
          raster ? r.raster_length : r.proposed_length, 100 * error[0], 100 * error[1], 100 * error[2],
          100 * holds[0], 100 * holds[1], 100 * holds[2]);
    }
  return words;
}

std::string next_press_csv(const NextPressScore& s) {
  std::string csv =
      "presses,scan,numbers,length,size_error,depth_error,ratio_error,size_hold,depth_hold,ratio_hold\n";
  for (const NextPressRow& r : s.rows)
    for (const bool raster : {true, false}) {
      const auto& error = raster ? r.raster_error : r.proposed_error;
      const auto& holds = raster ? r.raster_holds : r.proposed_holds;
      csv +=
          text("%zu,%s,%zu,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g\n", r.presses, raster ? "raster" : "proposed",
               raster ? r.raster_numbers : r.proposed_numbers, raster ? r.raster_length : r.proposed_length,
               error[0], error[1], error[2], holds[0], holds[1], holds[2]);
    }
  return csv;
}

json::Value next_press_json(const NextPressScore& s) {
  json::Value rows = json::Value::array();
  for (const NextPressRow& r : s.rows)
    rows.push_back({{"presses", r.presses},
                    {"raster_numbers", r.raster_numbers},
                    {"proposed_numbers", r.proposed_numbers},
                    {"raster_length", r.raster_length},
                    {"proposed_length", r.proposed_length},
                    {"raster_error", r.raster_error},
                    {"proposed_error", r.proposed_error},
                    {"raster_holds", r.raster_holds},
                    {"proposed_holds", r.proposed_holds}});
  return {{"lumps", s.lumps},
          {"plain", s.plain},
          {"raster_presses", s.raster_presses},
          {"reached", s.reached},
          {"presses_to_reach", s.presses_to_reach},
          {"mean_stopped", s.mean_stopped},
          {"harder", s.harder},
          {"harder_told", s.harder_told},
          {"harder_found", s.harder_found},
          {"false_lumps", s.false_lumps},
          {"rows", std::move(rows)}};
}

}  // namespace palpate::lump
