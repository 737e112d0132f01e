#include "perf/lab/study/pairs/pair_evaluation.h"

#include <cmath>
#include <utility>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"

namespace palpate::lump {
namespace {

/// Edges of the table's rows, distances over mean diameters; the last row is of all.
constexpr std::array<double, 4> kPairEdges = {0, 1.5, 1.9, 1e9};

/// Lumps of one row of the table.
struct PairRow {
  double from = 0, to = 0;
  size_t blocks = 0, told = 0, reported = 0;  ///< readings; lumps that report numbers
  std::array<double, 3> median{};             ///< errors of size, depth and ratio
  std::array<double, 3> hold{};               ///< intervals
  double place_mm = 0;                        ///< median
};

std::array<double, 3> true_values(const Case::Lump& lump) {
  return {lump.diameter_mm, lump.depth_mm, lump.stiffness_ratio};
}

PairRow row_of(const std::vector<JudgedPair>& judged, double from, double to) {
  PairRow row{from, to, 0, 0, 0, {}, {}, 0};
  std::array<std::vector<double>, 3> errors;
  std::array<double, 3> held{};
  std::vector<double> places;
  for (const JudgedPair& j : judged) {
    if (j.distance_over_size() < from || j.distance_over_size() >= to) continue;
    ++row.blocks;
    row.told += j.told();
    for (size_t i = 0; i < 2 && j.told(); ++i) {
      const Estimate& e = j.estimate.lumps[j.answer[i]];
      if (!reports_numbers(e.verdict)) continue;
      ++row.reported;
      const auto truth = true_values(j.truth[i]);
      const std::array<Value, 3> values = {e.size_mm, e.depth_mm, e.stiffness_ratio};
      for (size_t p = 0; p < 3; ++p) {
        errors[p].push_back(std::abs(values[p].value / truth[p] - 1));
        held[p] += truth[p] >= values[p].low && truth[p] <= values[p].high;
      }
      places.push_back(
          std::hypot(e.x_mm.value - j.truth[i].offset_mm[0], e.y_mm.value - j.truth[i].offset_mm[1]));
    }
  }
  for (size_t p = 0; p < 3; ++p) {
    row.median[p] = median(errors[p]);
    row.hold[p] = row.reported > 0 ? held[p] / static_cast<double>(row.reported) : kNaN;
  }
  row.place_mm = median(places);
  return row;
}

std::vector<PairRow> pair_rows(const std::vector<JudgedPair>& judged) {
  std::vector<PairRow> rows;
  for (size_t i = 0; i + 1 < kPairEdges.size(); ++i)
    rows.push_back(row_of(judged, kPairEdges[i], kPairEdges[i + 1]));
  rows.push_back(row_of(judged, kPairEdges.front(), kPairEdges.back()));
  return rows;
}

double apart(const Case::Lump& lump, const Estimate& e) {
  return std::hypot(e.x_mm.value - lump.offset_mm[0], e.y_mm.value - lump.offset_mm[1]);
}

}  // namespace

double JudgedPair::distance_mm() const {
  return std::hypot(truth[0].offset_mm[0] - truth[1].offset_mm[0],
                    truth[0].offset_mm[1] - truth[1].offset_mm[1]);
}

double JudgedPair::distance_over_size() const {
  return 2 * distance_mm() / (truth[0].diameter_mm + truth[1].diameter_mm);
}

std::vector<JudgedPair> judge_pairs(const Data& data, const PairJob& job) {
  std::vector<JudgedPair> judged;
  for (const Sample& sample : data.samples) {
    if (!sample.what.lump || !sample.what.second || sample.pressure_Pa.empty()) continue;
    const size_t all = sample.pressure_Pa.size(),
                 count = job.loads == 0 ? all : std::min<size_t>(job.loads, all);
    std::vector<PressureMap> maps;
    std::vector<double> forces;
    for (size_t k = 0; k < count; ++k) {
      const size_t load = all - 1 - (count - 1 - k) * all / count;
      maps.push_back(sample.pressure_Pa[load]);
      forces.push_back(sample.force_N[load]);
    }
    const std::array<double, 3> block = {data.sweep.block_mm[0], data.sweep.block_mm[1],
                                         sample.what.thickness_mm};
    for (uint32_t repeat = 0; repeat < job.repeats; ++repeat) {
      const uint64_t seed = job.seed * 1000003 + sample.what.number + repeat * 0x9e3779b1ULL;
      JudgedPair one;
      one.number = sample.what.number;
      one.truth = {*sample.what.lump, *sample.what.second};
      one.estimate =
          job.estimator(sensor_observation(maps, forces, block, sample.what.young_Pa, job.sensor, seed));
      if (one.told()) {
        const std::vector<Estimate>& lumps = one.estimate.lumps;
        const bool crossed = apart(one.truth[0], lumps[1]) + apart(one.truth[1], lumps[0]) <
                             apart(one.truth[0], lumps[0]) + apart(one.truth[1], lumps[1]);
        one.answer = crossed ? std::array<size_t, 2>{1, 0} : std::array<size_t, 2>{0, 1};
      }
      judged.push_back(std::move(one));
    }
  }
  return judged;
}

std::string pairs_text(const std::vector<JudgedPair>& judged) {
  std::string table =
      "distance over size  readings  two told  lumps with numbers  errors of size, depth, ratio   hold       "
      "  "
      "    place\n";
  for (const PairRow& row : pair_rows(judged)) {
    const std::string range = row.from <= 0 && row.to > 1e6 ? std::string("all")
                              : row.to > 1e6                ? text("%.3g and more", row.from)
                                                            : text("%.3g to %.3g", row.from, row.to);
    table += text("%-18s %9zu %9zu %19zu", range.c_str(), row.blocks, row.told, row.reported);
    if (row.reported > 0)
      table += text("  %5.1f, %5.1f, %5.1f %%          %3.0f, %3.0f, %3.0f %%  %.2g mm", 100 * row.median[0],
                    100 * row.median[1], 100 * row.median[2], 100 * row.hold[0], 100 * row.hold[1],
                    100 * row.hold[2], row.place_mm);
    table += "\n";
  }
  return table;
}

std::string pairs_csv(const std::vector<JudgedPair>& judged) {
  std::string csv =
      "block,lump,distance_mm,distance_over_size,verdict,true_size_mm,true_depth_mm,true_ratio,lump_verdict";
  for (const char* name : {"size_mm", "depth_mm", "ratio"})
    csv += text(",%s,%s_low,%s_high", name, name, name);
  csv += ",place_error_mm\n";
  for (const JudgedPair& j : judged)
    for (size_t i = 0; i < 2; ++i) {
      const Case::Lump& t = j.truth[i];
      csv += text("%u,%zu,%.4g,%.4g,%s,%.4g,%.4g,%.4g", j.number, i, j.distance_mm(), j.distance_over_size(),
                  to_string(j.estimate.verdict), t.diameter_mm, t.depth_mm, t.stiffness_ratio);
      if (!j.told()) {
        csv += ",,,,,,,,,,,\n";
        continue;
      }
      const Estimate& e = j.estimate.lumps[j.answer[i]];
      csv += text(",%s", to_string(e.verdict));
      for (const Value& v : {e.size_mm, e.depth_mm, e.stiffness_ratio})
        csv += text(",%.4g,%.4g,%.4g", v.value, v.low, v.high);
      csv += text(",%.3g\n", apart(t, e));
    }
  return csv;
}

json::Value pairs_json(const std::vector<JudgedPair>& judged) {
  json::Value rows = json::Value::array();
  for (const PairRow& row : pair_rows(judged))
    rows.push_back({{"distance_over_size", {row.from, row.to}},
                    {"readings", row.blocks},
                    {"told_as_two", row.told},
                    {"lumps_with_numbers", row.reported},
                    {"median_error", row.median},
                    {"hold", row.hold},
                    {"place_mm", row.place_mm}});
  return {{"rows", rows}};
}

}  // namespace palpate::lump
