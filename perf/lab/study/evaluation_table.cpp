#include "perf/lab/study/evaluation_table.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/json.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"

namespace palpate::lump {
namespace {

struct TableSetting {
  double noise_fraction, exposure;
  uint32_t loads;
};

std::vector<TableSetting> settings(ScoreOver what, const PalpationSensor& sensor) {
  std::vector<TableSetting> all;
  switch (what) {
    case ScoreOver::Noise:
      for (const double noise : {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1})
        for (const uint32_t loads : {1u, 2u, 4u}) all.push_back({noise, sensor.exposure, loads});
      break;
    case ScoreOver::Exposure:
      for (const uint32_t loads : {1u, 4u})
        for (const double exposure : {0.9, 1.02, 1.05, 1.1, 1.25, 1.5, 2.0, 3.0})
          all.push_back({sensor.noise_fraction, exposure, loads});
      break;
    case ScoreOver::Loads:
      for (const uint32_t loads : {1u, 2u, 4u})
        all.push_back({sensor.noise_fraction, sensor.exposure, loads});
      break;
  }
  return all;
}

double median_saturated(const std::vector<Judged>& judged) {
  std::vector<double> fractions;
  for (const Judged& j : judged)
    if (j.truth.lump) fractions.push_back(j.saturated_fraction);
  return median(fractions);
}

double share(size_t part, size_t whole) {
  return static_cast<double>(part) / static_cast<double>(std::max<size_t>(1, whole));
}

double verdict_fraction(const Score& s, Status verdict) {
  return share(s.verdicts[static_cast<size_t>(verdict)], s.lumps);
}

/// All numbers of a row by name; NaN where there is none.
std::vector<std::pair<const char*, double>> cells(const ScoreRow& r) {
  const Score& s = r.score;
  return {{"noise_share", r.noise_fraction},
          {"loads", r.loads},
          {"exposure", r.exposure},
          {"saturated_share", r.saturated_fraction},
          {"lumps", static_cast<double>(s.lumps)},
          {"without_lump", static_cast<double>(s.plain)},
          {"judged", static_cast<double>(s.judged)},
          {"median_size_error", s.median[0]},
          {"median_depth_error", s.median[1]},
          {"median_ratio_error", s.median[2]},
          {"size_coverage", s.coverage[0]},
          {"depth_coverage", s.coverage[1]},
          {"ratio_coverage", s.coverage[2]},
          {"sensitivity", s.sensitivity},
          {"specificity", s.specificity},
          {"stiffness_open", verdict_fraction(s, Status::StiffnessOpen)},
          {"saturated", verdict_fraction(s, Status::Saturated)},
          {"several_lumps", verdict_fraction(s, Status::SeveralLumps)},
          {"outside_training", verdict_fraction(s, Status::OutsideTraining)},
          {"inconsistent", verdict_fraction(s, Status::Inconsistent)},
          {"unusable", verdict_fraction(s, Status::Unusable)},
          {"wall_ms", s.wall_ms}};
}

}  // namespace

size_t rows_of(ScoreOver what) {
  return settings(what, {}).size();
}

std::vector<ScoreRow> scores_over(ScoreOver what, const std::vector<Example>& examples,
                                  const EvaluationJob& job) {
  std::vector<ScoreRow> rows;
  for (const TableSetting& setting : settings(what, job.sensor)) {
    EvaluationJob one = job;
    one.sensor.noise_fraction = setting.noise_fraction;
    one.sensor.exposure = setting.exposure;
    one.loads = setting.loads;
    const size_t each = count_judged(examples.size(), job), before = rows.size() * each;
    if (job.progress) one.progress = [&](size_t done) { return job.progress(before + done); };
    const std::vector<Judged> judged = judge_lumps(examples, one);
    if (judged.size() < each) throw Stopped();
    rows.push_back({setting.noise_fraction, setting.exposure, setting.loads, median_saturated(judged),
                    score_of(judged)});
  }
  return rows;
}

std::string rows_text(const std::vector<ScoreRow>& rows) {
  std::string text =
      "                            median error of       intervals hold      lumps  stiffness        told   "
      "outside\n"
      "noise  loads  peak   sat.   d      h      E_r     d     h     E_r     found  open   saturated  "
      "several  "
      "training  time\n";
  for (const ScoreRow& r : rows) {
    const Score& s = r.score;
    const std::string line = palpate::text(
        "%4.1f %% %4u  %4.0f %% %4.1f %%  %4.1f %% %4.1f %% %5.1f %%  %3.0f %% %3.0f %% %3.0f %%   %3.0f "
        "%%  %3.0f %%   %3.0f %%     %3.0f %%    %3.0f %%   %5.1f ms\n",
        100 * r.noise_fraction, r.loads, 100 * r.exposure, 100 * r.saturated_fraction, 100 * s.median[0],
        100 * s.median[1], 100 * s.median[2], 100 * s.coverage[0], 100 * s.coverage[1], 100 * s.coverage[2],
        100 * s.sensitivity, 100 * verdict_fraction(s, Status::StiffnessOpen),
        100 * verdict_fraction(s, Status::Saturated), 100 * verdict_fraction(s, Status::SeveralLumps),
        100 * verdict_fraction(s, Status::OutsideTraining), s.wall_ms);
    text += line;
  }
  return text;
}

std::string rows_csv(const std::vector<ScoreRow>& rows) {
  std::string csv;
  for (const ScoreRow& row : rows) {
    const auto all = cells(row);
    if (csv.empty())
      for (const auto& [name, value] : all) csv += (csv.empty() ? "" : ",") + std::string(name);
    std::string line;
    for (const auto& [name, value] : all)
      line += (line.empty() ? "\n" : ",") + (std::isfinite(value) ? text("%.7g", value) : "");
    csv += line;
  }
  return csv + "\n";
}

json::Value rows_json(const std::vector<ScoreRow>& rows) {
  auto json = json::Value::array();
  for (const ScoreRow& row : rows) {
    json::Value one;
    for (const auto& [name, value] : cells(row)) one[name] = value;
    json.push_back(std::move(one));
  }
  return json;
}

}  // namespace palpate::lump
