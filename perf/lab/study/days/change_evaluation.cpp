#include "perf/lab/study/days/change_evaluation.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "engine/base/normal.h"
#include "engine/base/numbers.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "perf/lab/study/evaluation.h"
#include "perf/lab/study/judged_by_team.h"

namespace palpate::lump {
namespace {

constexpr double kGrowth = 0.05;  // of the size that has to be told

Day seen(const Example& e, const ChangeJob& job, const Network& network, std::array<double, 2> window_mm,
         uint64_t seed) {
  PalpationSensor sensor = job.sensor;
  sensor.window_center_mm = window_mm;
  Day day{sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, sensor, seed), {}};
  day.observation.window_mm = {0, 0};
  day.observation.place_sd_mm = job.place_sd_mm;
  day.estimate = network.estimate(day.observation);
  return day;
}

JudgedChange judge(const Example& first, const Example& second, const ChangeJob& job, const Network& network,
                   uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> aside(-job.place_mm, job.place_mm);
  const std::array<double, 2> window_mm = {aside(random), aside(random)};
  JudgedChange judged{first,
                      second,
                      seen(first, job, network, {0, 0}, random()),
                      seen(second, job, network, window_mm, random()),
                      {}};
  judged.change = compare(network, judged.a, judged.b, job.sources);
  for (Example* e : {&judged.first, &judged.second}) e->pressure_Pa.clear();
  for (Day* day : {&judged.a, &judged.b}) day->observation.pressure_Pa.clear();
  return judged;
}

struct Summary {
  size_t compared = 0, grown = 0, shrunk = 0, ratio_changed = 0;
  std::array<size_t, 3> hold{};
  std::array<std::vector<double>, 3> error, separate_error;  ///< of factors
  std::vector<double> least_share;                           ///< growth that would be told, over the size
};

Summary summary_of(const std::vector<JudgedChange>& judged) {
  Summary s;
  for (const JudgedChange& j : judged) {
    if (!std::isfinite(j.change.factor[0].value)) continue;
    ++s.compared;
    s.grown += j.change.verdict == ChangeVerdict::Grown;
    s.shrunk += j.change.verdict == ChangeVerdict::Shrunk;
    s.ratio_changed += j.change.ratio_changed;
    const auto truth = j.truth();
    const auto a = values_of(j.a.estimate), b = values_of(j.b.estimate);
    for (size_t p = 0; p < 3; ++p) {
      const Value& factor = j.change.factor[p];
      s.hold[p] += truth[p] >= factor.low && truth[p] <= factor.high;
      s.error[p].push_back(std::abs(factor.value - truth[p]));
      s.separate_error[p].push_back(std::abs(b[p].value / a[p].value - truth[p]));
    }
    s.least_share.push_back(j.change.least_mm / j.first.size_mm);
  }
  return s;
}

/// How far readings of one pair differ, beside the errors that are stated: RMS over pairs, of logarithms.
struct Repeats {
  std::array<double, 3> spread{}, stated{};
  size_t readings = 0;
};

bool same_pair(const JudgedChange& a, const JudgedChange& b) {
  return truth_of(a.first) == truth_of(b.first) && truth_of(a.second) == truth_of(b.second) &&
         a.first.offset_mm == b.first.offset_mm;
}

Repeats repeats_of(const std::vector<JudgedChange>& judged) {
  Repeats r;
  double freedom = 0;
  for (size_t from = 0, to = 0; from < judged.size(); from = to) {
    std::vector<const JudgedChange*> readings;
    for (to = from; to < judged.size() && same_pair(judged[from], judged[to]); ++to)
      if (std::isfinite(judged[to].change.factor[0].value)) readings.push_back(&judged[to]);
    if (readings.size() < 2) continue;
    const auto count = static_cast<double>(readings.size());
    r.readings += readings.size();
    freedom += count - 1;
    for (size_t p = 0; p < 3; ++p) {
      double mean = 0;
      for (const JudgedChange* one : readings) mean += std::log(one->change.factor[p].value) / count;
      for (const JudgedChange* one : readings) {
        const Value& v = one->change.factor[p];
        r.spread[p] += std::pow(std::log(v.value) - mean, 2);
        r.stated[p] += std::pow(std::log(v.high / v.low) / (2 * kNormal90), 2);
      }
    }
  }
  for (size_t p = 0; p < 3; ++p) {
    r.spread[p] = std::sqrt(r.spread[p] / freedom);
    r.stated[p] = std::sqrt(r.stated[p] / static_cast<double>(r.readings));
  }
  return r;
}

double share_of(size_t part, size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : kNaN;
}

double median_of(const std::vector<double>& values) {
  return values.empty() ? kNaN : median(values);
}

double ninetieth_of(std::vector<double> values) {
  return values.empty() ? kNaN : quantile_in_place(values, 0.9);
}

}  // namespace

std::array<double, 3> JudgedChange::truth() const {
  const auto from = truth_of(first), to = truth_of(second);
  return {to[0] / from[0], to[1] / from[1], to[2] / from[2]};
}

void pair_days(std::vector<Example>& first, std::vector<Example>& second) {
  std::vector<Example> a, b;
  for (Example& one : first) {
    const auto same = std::find_if(second.begin(), second.end(), [&](const Example& other) {
      return other.young_Pa == one.young_Pa && other.block_mm == one.block_mm && other.shape == one.shape &&
             other.offset_mm == one.offset_mm;
    });
    if (same == second.end() || !one.lump || !same->lump) continue;
    a.push_back(std::move(one));
    b.push_back(*same);
  }
  first = std::move(a);
  second = std::move(b);
}

std::vector<JudgedChange> judge_changes(const std::vector<Example>& first, const std::vector<Example>& second,
                                        const ChangeJob& job) {
  const auto network = load_network("");
  return judged_by_team(first.size() * job.repeats, job.threads, job.progress, [&](size_t n) {
    const size_t pair = n / job.repeats;
    return judge(first[pair], second[pair], job, *network, job.seed * 1000003 + n);
  });
}

std::string changes_text(const std::vector<JudgedChange>& judged) {
  const Summary s = summary_of(judged);
  const Repeats r = repeats_of(judged);
  const auto all = [](const auto& of, double scale) {
    return text("%.2g, %.2g, %.2g", scale * of(0), scale * of(1), scale * of(2));
  };
  return text(
             "%zu pairs, %zu compared: grown %zu (%.3g %%), shrunk %zu (%.3g %%), stiffness changed %zu "
             "(%.3g %%)\n",
             judged.size(), s.compared, s.grown, 100 * share_of(s.grown, s.compared), s.shrunk,
             100 * share_of(s.shrunk, s.compared), s.ratio_changed,
             100 * share_of(s.ratio_changed, s.compared)) +
         "intervals of the change of size, depth, ratio hold " +
         text("%.3g, %.3g, %.3g", 100 * share_of(s.hold[0], s.compared),
              100 * share_of(s.hold[1], s.compared), 100 * share_of(s.hold[2], s.compared)) +
         " %\nerrors of the change, median: " + all([&](size_t p) { return median_of(s.error[p]); }, 100) +
         " %, nine in ten below " + all([&](size_t p) { return ninetieth_of(s.error[p]); }, 100) +
         " %\nof two separate estimates, median: " +
         all([&](size_t p) { return median_of(s.separate_error[p]); }, 100) + " %, nine in ten below " +
         all([&](size_t p) { return ninetieth_of(s.separate_error[p]); }, 100) +
         text(" %%\ngrowth that would be told, median: %.2g %% of the diameter, nine in ten below %.2g %%\n",
              100 * median_of(s.least_share), 100 * ninetieth_of(s.least_share)) +
         (r.readings == 0
              ? std::string()
              : "readings of one pair spread by " + all([&](size_t p) { return r.spread[p]; }, 100) +
                    " %, errors stated " + all([&](size_t p) { return r.stated[p]; }, 100) + " %\n");
}

json::Value changes_json(const std::vector<JudgedChange>& judged) {
  const Summary s = summary_of(judged);
  json::Value v = {{"pairs", judged.size()},
                   {"compared", s.compared},
                   {"grown", s.grown},
                   {"shrunk", s.shrunk},
                   {"ratio_changed", s.ratio_changed},
                   {"least_growth_share", median_of(s.least_share)}};
  const Repeats r = repeats_of(judged);
  constexpr const char* kNames[] = {"size", "depth", "ratio"};
  for (size_t p = 0; p < 3; ++p)
    v[kNames[p]] = {{"hold", share_of(s.hold[p], s.compared)},
                    {"median_error", median_of(s.error[p])},
                    {"ninetieth_error", ninetieth_of(s.error[p])},
                    {"separate_median_error", median_of(s.separate_error[p])},
                    {"separate_ninetieth_error", ninetieth_of(s.separate_error[p])},
                    {"spread", r.spread[p]},
                    {"stated_sd", r.stated[p]}};
  return v;
}

judge::Cases cases_of(const std::vector<JudgedChange>& judged) {
  judge::Cases cases;
  cases.conditions = {{"size_mm", {}}, {"depth_mm", {}}, {"ratio", {}}, {"growth", {}}, {"shape", {}}};
  for (size_t s = 0; s < 4; ++s)
    cases.conditions.back().labels.emplace_back(to_string(static_cast<InclusionShape>(s)));
  cases.quantities = {{"size_factor", 0.9}, {"depth_factor", 0.9}, {"ratio_factor", 0.9}};
  cases.wrong_means =
      text("growth of %.0f %% and more that is not told, or a change that is not there", 100 * kGrowth);
  for (const JudgedChange& j : judged) {
    const auto truth = j.truth();
    judge::JudgedCase one;
    one.conditions = {j.first.size_mm, j.first.depth_mm, j.first.stiffness_ratio, truth[0] - 1,
                      static_cast<double>(j.first.shape)};
    one.reported = std::isfinite(j.change.factor[0].value);
    const ChangeVerdict right = truth[0] >= 1 + kGrowth   ? ChangeVerdict::Grown
                                : truth[0] <= 1 - kGrowth ? ChangeVerdict::Shrunk
                                                          : ChangeVerdict::NoChange;
    one.wrong = one.reported && j.change.verdict != right;
    for (size_t p = 0; p < 3; ++p) {
      const Value& v = j.change.factor[p];
      one.values.push_back({truth[p], v.value, v.low, v.high});
    }
    cases.cases.push_back(one);
  }
  return cases;
}

}  // namespace palpate::lump
