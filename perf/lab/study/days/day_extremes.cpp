#include "perf/lab/study/days/day_extremes.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/estimator.h"
#include "perf/lab/study/judged_by_team.h"

namespace palpate::lump {
namespace {

/// A day as told: what of the observation is not as it was.
struct DayAsTold {
  double pressure_factor = 1, young_factor = 1;
  bool turned = false;
};

Day seen(const Example& e, PalpationSensor sensor, const DayAsTold& told, std::array<double, 2> window_mm,
         double place_sd_mm, const Network& network, uint64_t seed) {
  sensor.window_center_mm = window_mm;
  Day day{
      sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, told.young_factor * e.young_Pa, sensor, seed),
      {}};
  day.observation.window_mm = {0, 0};
  day.observation.place_sd_mm = place_sd_mm;
  day.observation.noise_Pa *= told.pressure_factor;
  for (PressureMap& map : day.observation.pressure_Pa) {
    for (float& value : map.values) value *= static_cast<float>(told.pressure_factor);
    if (told.turned) std::reverse(map.values.begin(), map.values.end());
  }
  day.estimate = network.estimate(day.observation);
  return day;
}

struct JudgedDays {
  LumpChange change;
  std::array<double, 3> truth{};
};

JudgedDays judge(const Example& first, const Example& second, const DayExtreme& extreme, const ChangeJob& job,
                 const Network& network, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> aside(-job.place_mm, job.place_mm);
  const std::array<double, 2> window_mm = {aside(random), aside(random)};
  const Day a = seen(first, extreme.first, {1, extreme.young_factor[0], false}, {0, 0}, job.place_sd_mm,
                     network, random());
  const Day b =
      seen(second, extreme.second, {extreme.pressure_factor, extreme.young_factor[1], extreme.turned},
           window_mm, job.place_sd_mm, network, random());
  JudgedChange truth{first, second, {}, {}, {}};
  return {compare(network, a, b, job.sources), truth.truth()};
}

ExtremeRow row_of(const DayExtreme& extreme, bool grown, const std::vector<JudgedDays>& pairs) {
  ExtremeRow row;
  row.name = extreme.name;
  row.grown = grown;
  row.pairs = pairs.size();
  std::array<std::vector<double>, 3> errors;
  for (const JudgedDays& pair : pairs) {
    const LumpChange& c = pair.change;
    if (!std::isfinite(c.factor[0].value)) {
      row.unexplained += c.reasons.empty();
      if (row.reason.empty() && !c.reasons.empty()) row.reason = c.reasons.back();
      continue;
    }
    ++row.compared;
    row.told_grown += c.verdict == ChangeVerdict::Grown;
    row.told_shrunk += c.verdict == ChangeVerdict::Shrunk;
    for (size_t p = 0; p < 3; ++p) {
      row.hold[p] += pair.truth[p] >= c.factor[p].low && pair.truth[p] <= c.factor[p].high;
      errors[p].push_back(std::abs(c.factor[p].value - pair.truth[p]));
    }
  }
  for (size_t p = 0; p < 3; ++p) row.error[p] = errors[p].empty() ? kNaN : median(errors[p]);
  return row;
}

}  // namespace

std::vector<DayExtreme> day_extremes(const PalpationSensor& sensor) {
  std::vector<DayExtreme> extremes;
  const auto add = [&](const char* name, const auto& change) {
    extremes.push_back({name, sensor, sensor});
    change(extremes.back());
  };
  add("same pad", [](DayExtreme&) {});
  add("pad of 1 % noise, pitch 1 mm, window 30 x 26 mm", [](DayExtreme& e) {
    e.second.noise_fraction = 0.01;
    e.second.node_pitch_mm = 1;
    e.second.window_mm = {30, 26};
  });
  add("pad of pitch 1.6 mm, window 40 x 30 mm", [](DayExtreme& e) {
    e.second.node_pitch_mm = 1.6;
    e.second.window_mm = {40, 30};
  });
  add("map turned by 180 degrees", [](DayExtreme& e) { e.turned = true; });
  for (const double factor : {1.03, 0.95})
    add("", [&](DayExtreme& e) {
      e.name = text("pressures %+.0f %%", 100 * (factor - 1));
      e.pressure_factor = factor;
    });
  add("another pattern, 0.5 % of 3 mm", [](DayExtreme& e) { e.second.pattern_fraction = 0.005; });
  for (const auto& [first, second] : {std::pair{1.0, 1.1}, {1.0, 1.3}, {0.7, 0.7}})
    add("", [&, of_first = first, of_second = second](DayExtreme& e) {
      e.name = text("modulus told %+.0f and %+.0f %%", 100 * (of_first - 1), 100 * (of_second - 1));
      e.young_factor = {of_first, of_second};
    });
  return extremes;
}

std::vector<ExtremeRow> judge_extremes(const std::vector<Example>& first, const std::vector<Example>& second,
                                       const std::vector<DayExtreme>& extremes, bool grown,
                                       const ChangeJob& job) {
  const auto network = load_network("");
  const size_t pairs = first.size() * job.repeats, count = pairs * extremes.size();
  const auto judged = judged_by_team(count, job.threads, job.progress, [&](size_t n) {
    const size_t pair = n % pairs / job.repeats;
    // The same places and noise under each extreme.
    return std::pair{n / pairs, judge(first[pair], second[pair], extremes[n / pairs], job, *network,
                                      job.seed * 1000003 + n % pairs)};
  });
  std::vector<ExtremeRow> rows;
  for (size_t e = 0; e < extremes.size(); ++e) {
    std::vector<JudgedDays> own;
    for (const auto& [extreme, days] : judged)
      if (extreme == e) own.push_back(days);
    if (!own.empty()) rows.push_back(row_of(extremes[e], grown, own));
  }
  return rows;
}

std::string extremes_text(const std::vector<ExtremeRow>& rows) {
  std::string table =
      "second day                                       lumps      compared  grown  shrunk  hold d, h, ratio "
      " "
      "errors, %\n";
  for (const ExtremeRow& r : rows) {
    table +=
        text("%-48s %-10s %zu of %-4zu %-6zu %-7zu %zu, %zu, %-10zu ", r.name.c_str(),
             r.grown ? "grown" : "unchanged", r.compared, r.pairs, r.told_grown, r.told_shrunk, r.hold[0],
             r.hold[1], r.hold[2]) +
        (r.compared > 0 ? text("%.2g, %.2g, %.2g\n", 100 * r.error[0], 100 * r.error[1], 100 * r.error[2])
                        : std::string("\n"));
    if (!r.reason.empty()) table += "  not comparable: " + r.reason + "\n";
  }
  return table;
}

std::string extremes_csv(const std::vector<ExtremeRow>& rows) {
  std::string csv =
      "second_day,lumps,pairs,compared,grown,shrunk,size_hold,depth_hold,ratio_hold,size_error,depth_error,"
      "ratio_error,reason\n";
  for (const ExtremeRow& r : rows) {
    csv += text("\"%s\",%s,%zu,%zu,%zu,%zu,%zu,%zu,%zu", r.name.c_str(), r.grown ? "grown" : "unchanged",
                r.pairs, r.compared, r.told_grown, r.told_shrunk, r.hold[0], r.hold[1], r.hold[2]);
    for (const double error : r.error) csv += r.compared > 0 ? text(",%.3g", error) : std::string(",");
    csv += ",\"" + r.reason + "\"\n";
  }
  return csv;
}

json::Value extremes_json(const std::vector<ExtremeRow>& rows) {
  json::Value all = json::Value::array();
  for (const ExtremeRow& r : rows)
    all.push_back({{"second_day", r.name},
                   {"lumps", r.grown ? "grown" : "unchanged"},
                   {"pairs", r.pairs},
                   {"compared", r.compared},
                   {"grown", r.told_grown},
                   {"shrunk", r.told_shrunk},
                   {"hold", r.hold},
                   {"without_reason", r.unexplained},
                   {"reason", r.reason}});
  return all;
}

}  // namespace palpate::lump
