#include "perf/lab/study/days/repeat_evaluation.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/base/normal.h"
#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/lump/observation/map_at_load.h"
#include "palpate/error.h"
#include "perf/lab/study/evaluation.h"
#include "perf/lab/study/judged_by_team.h"

namespace palpate::lump {
namespace {

constexpr size_t kPressLoads = 4;
constexpr size_t kLeastLoads = 6;  // between which maps are interpolated

/// The example's maps at four loads up to a share of its highest one.
Example at_loads(const Example& example, double share) {
  Observation truth;
  truth.pressure_Pa = example.pressure_Pa;
  truth.force_N = example.force_N;
  Example pressed = example;
  pressed.pressure_Pa.clear();
  pressed.force_N.clear();
  for (size_t l = 1; l <= kPressLoads; ++l) {
    const double force_N = share * example.force_N.back() * static_cast<double>(l) / kPressLoads;
    pressed.pressure_Pa.push_back(map_at_load(truth, force_N));
    pressed.force_N.push_back(force_N);
  }
  return pressed;
}

Day press(const Example& example, const RepeatJob& job, std::mt19937_64& random) {
  std::uniform_real_distribution<double> even(-1, 1);
  // The nominal highest load is so much below the example's that no press exceeds that.
  const double share = (1 + job.load_share * even(random)) / (1 + job.load_share);
  PalpationSensor sensor = job.sensor;
  for (double& at : sensor.window_center_mm) at = job.place_mm * even(random);
  const Example pressed = at_loads(example, share);
  Day day{sensor_observation(pressed.pressure_Pa, pressed.force_N, example.block_mm, example.young_Pa, sensor,
                             random()),
          {}};
  day.observation.window_mm = {0, 0};
  day.observation.place_sd_mm = job.place_sd_mm;
  day.estimate = job.estimator(day.observation);
  return day;
}

RepeatedBlock judge(const Example& example, const RepeatJob& job, const Network& network, uint64_t seed) {
  ErrorSources place = ErrorSources::none();
  place.place = true;
  std::mt19937_64 random(seed);
  RepeatedBlock block;
  block.truth = example;
  block.truth.pressure_Pa.clear();
  for (uint32_t n = 0; n + 1 < job.presses; n += 2) {
    const Day first = press(example, job, random), second = press(example, job, random);
    block.changes.push_back(compare(network, first, second, place));
    block.estimates.push_back(first.estimate);
    block.estimates.push_back(second.estimate);
  }
  return block;
}

double stated_of(const Value& v) {
  return std::log(v.high / v.low) / (2 * kNormal90);
}

/// Logarithms and the errors that are stated of them, per quantity. `fitted`: their mean is taken off.
Spread spread_of(const std::array<std::vector<Value>, 3>& values, bool fitted) {
  Spread s;
  s.readings = values[0].size();
  s.spread.fill(kNaN);
  s.stated.fill(kNaN);
  if (s.readings < 2) return s;
  const auto count = static_cast<double>(s.readings);
  for (size_t p = 0; p < 3; ++p) {
    double mean = 0, squares = 0, stated = 0;
    for (const Value& v : values[p]) mean += fitted ? std::log(v.value) / count : 0;
    for (const Value& v : values[p]) {
      squares += std::pow(std::log(v.value) - mean, 2);
      stated += std::pow(stated_of(v), 2);
    }
    s.spread[p] = std::sqrt(squares / (fitted ? count - 1 : count));
    s.stated[p] = std::sqrt(stated / count);
  }
  return s;
}

/// Root of the mean of squares over blocks.
Spread together(const std::vector<RepeatedBlock>& blocks, Spread (*of)(const RepeatedBlock&)) {
  Spread all;
  double count = 0;
  for (const RepeatedBlock& block : blocks) {
    const Spread s = of(block);
    if (s.readings < 2) continue;
    all.readings += s.readings;
    ++count;
    for (size_t p = 0; p < 3; ++p) {
      all.spread[p] += s.spread[p] * s.spread[p];
      all.stated[p] += s.stated[p] * s.stated[p];
    }
  }
  for (auto* part : {&all.spread, &all.stated})
    for (double& value : *part) value = std::sqrt(value / count);
  return all;
}

std::string three(const std::array<double, 3>& values, double scale) {
  return text("%.2g, %.2g, %.2g", scale * values[0], scale * values[1], scale * values[2]);
}

size_t told_changes(const RepeatedBlock& block) {
  return static_cast<size_t>(
      std::count_if(block.changes.begin(), block.changes.end(), [](const LumpChange& c) {
        return c.verdict == ChangeVerdict::Grown || c.verdict == ChangeVerdict::Shrunk;
      }));
}

json::Value spread_json(const Spread& s) {
  return {{"readings", s.readings},
          {"spread", s.spread},
          {"stated_sd", s.stated},
          {"over_stated", s.over_stated()}};
}

}  // namespace

std::array<double, 3> Spread::over_stated() const {
  return {spread[0] / stated[0], spread[1] / stated[1], spread[2] / stated[2]};
}

Spread estimates_spread(const RepeatedBlock& block) {
  std::array<std::vector<Value>, 3> values;
  for (const Estimate& e : block.estimates) {
    if (!reports_numbers(e.verdict)) continue;
    const auto of = values_of(e);
    for (size_t p = 0; p < 3; ++p) values[p].push_back(of[p]);
  }
  return spread_of(values, true);
}

Spread changes_spread(const RepeatedBlock& block) {
  std::array<std::vector<Value>, 3> values;
  for (const LumpChange& c : block.changes)
    for (size_t p = 0; p < 3 && std::isfinite(c.factor[0].value); ++p) values[p].push_back(c.factor[p]);
  return spread_of(values, false);
}

std::vector<RepeatedBlock> judge_repeats(const std::vector<Example>& examples, const RepeatJob& job) {
  const auto network = load_network("");
  std::vector<size_t> lumps;
  for (size_t n = 0; n < examples.size(); ++n) {
    if (!examples[n].lump) continue;
    lumps.push_back(n);
    if (examples[n].force_N.size() < kLeastLoads)
      throw Error(Failure::Input, "blocks of six loads or more, between which presses lie",
                  std::to_string(examples[n].force_N.size()) + " loads of block " + std::to_string(n),
                  "palpate-lab dataset --loads 6");
  }
  return judged_by_team(lumps.size(), job.threads, job.progress, [&](size_t n) {
    RepeatedBlock found = judge(examples[lumps[n]], job, *network, job.seed * 1000003 + lumps[n]);
    found.number = lumps[n];
    return found;
  });
}

std::string repeats_text(const std::vector<RepeatedBlock>& blocks) {
  std::string table =
      "size, depth and ratio: spread of a block's presses and the standard errors that they state, %, and "
      "the "
      "one over the other\n"
      "block                             reported  spread            stated            over stated       "
      "change over stated  told\n";
  size_t told = 0, compared = 0;
  for (const RepeatedBlock& b : blocks) {
    const Spread e = estimates_spread(b), c = changes_spread(b);
    told += told_changes(b);
    compared += c.readings;
    const std::string what = text("%s %.3g mm, %.2g deep, %.2g", to_string(b.truth.shape), b.truth.size_mm,
                                  b.truth.depth_mm, b.truth.stiffness_ratio);
    table += text("%-33s %zu of %-4zu %-17s %-17s %-17s %-19s %zu of %zu\n", what.c_str(), e.readings,
                  b.estimates.size(), three(e.spread, 100).c_str(), three(e.stated, 100).c_str(),
                  three(e.over_stated(), 1).c_str(), three(c.over_stated(), 1).c_str(), told_changes(b),
                  c.readings);
  }
  const Spread e = together(blocks, estimates_spread), c = together(blocks, changes_spread);
  return table + "all: spread " + three(e.spread, 100) + " %, stated " + three(e.stated, 100) +
         " %, over stated " + three(e.over_stated(), 1) + "\nchanges from press to press: spread " +
         three(c.spread, 100) + " %, stated " + three(c.stated, 100) + " %, over stated " +
         three(c.over_stated(), 1) + text("; %zu of %zu told as grown or shrunk\n", told, compared);
}

std::string repeats_csv(const std::vector<RepeatedBlock>& blocks) {
  std::string csv = "block,shape,size_mm,depth_mm,stiffness_ratio,presses,reported";
  for (const char* kind : {"", "change_"})
    for (const char* name : {"size", "depth", "ratio"})
      csv += text(",%s%s_spread,%s%s_stated,%s%s_over_stated", kind, name, kind, name, kind, name);
  csv += ",changes,told_as_changed\n";
  for (const RepeatedBlock& b : blocks) {
    const Spread e = estimates_spread(b), c = changes_spread(b);
    csv += text("%zu,%s,%.4g,%.4g,%.4g,%zu,%zu", b.number, to_string(b.truth.shape), b.truth.size_mm,
                b.truth.depth_mm, b.truth.stiffness_ratio, b.estimates.size(), e.readings);
    for (const Spread* s : {&e, &c})
      for (size_t p = 0; p < 3; ++p)
        csv += std::isfinite(s->spread[p])
                   ? text(",%.3g,%.3g,%.3g", s->spread[p], s->stated[p], s->over_stated()[p])
                   : std::string(",,,");
    csv += text(",%zu,%zu\n", c.readings, told_changes(b));
  }
  return csv;
}

json::Value repeats_json(const std::vector<RepeatedBlock>& blocks) {
  json::Value rows = json::Value::array();
  for (const RepeatedBlock& b : blocks)
    rows.push_back({{"block", b.number},
                    {"size_mm", b.truth.size_mm},
                    {"depth_mm", b.truth.depth_mm},
                    {"stiffness_ratio", b.truth.stiffness_ratio},
                    {"presses", b.estimates.size()},
                    {"estimates", spread_json(estimates_spread(b))},
                    {"changes", spread_json(changes_spread(b))},
                    {"told_as_changed", told_changes(b)}});
  return {{"blocks", rows},
          {"estimates", spread_json(together(blocks, estimates_spread))},
          {"changes", spread_json(together(blocks, changes_spread))}};
}

}  // namespace palpate::lump
