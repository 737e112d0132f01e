#include "perf/lab/study/limit_evaluation.h"

#include <array>
#include <cmath>

#include "engine/base/text.h"
#include "engine/lump/estimator.h"
#include "engine/lump/network/limit_search.h"

namespace palpate::lump {
namespace {

/// Edges of the table's rows, sizes over their limits.
constexpr std::array<double, 8> kLimitEdges = {0, 1e-9, 0.6, 0.8, 1, 1.25, 1.6, 1e9};

struct LimitRow {
  double from = 0, to = 0;
  size_t lumps = 0, seen = 0;
};

std::vector<LimitRow> rows_of(const std::vector<JudgedLimit>& judged) {
  std::vector<LimitRow> rows;
  for (size_t i = 0; i + 1 < kLimitEdges.size(); ++i) {
    LimitRow row{kLimitEdges[i], kLimitEdges[i + 1], 0, 0};
    for (const JudgedLimit& j : judged) {
      const bool here = j.over_limit() >= row.from && j.over_limit() < row.to;
      row.lumps += here;
      row.seen += here && j.seen();
    }
    rows.push_back(row);
  }
  return rows;
}

double limit_of(const Network& network, const Example& e, const PalpationSensor& sensor, uint64_t seed) {
  const Model& model = network.model();
  const Observation plain = plain_observation(model, e.block_mm[2], e.young_Pa, e.force_N, sensor, seed);
  Estimate trouble;
  const auto nodes = pressed_nodes(model, plain, trouble);
  if (!nodes) return std::nan("");
  return DetectionLimits(model, *nodes, Method::Refined, e.offset_mm)
      .size_mm(e.shape, e.depth_mm, e.stiffness_ratio);
}

}  // namespace

double JudgedLimit::over_limit() const {
  return std::isnan(limit_mm) ? 0 : truth.size_mm / limit_mm;
}

std::vector<JudgedLimit> judge_limits(const std::vector<Example>& examples, const LimitJob& job) {
  const auto network = load_network("");
  std::vector<JudgedLimit> judged;
  for (size_t n = 0; n < examples.size(); ++n) {
    const Example& e = examples[n];
    if (!e.lump || (e.shape != InclusionShape::Sphere && e.shape != InclusionShape::Cylinder)) continue;
    for (const double noise : job.noise_fractions) {
      PalpationSensor sensor = job.sensor;
      sensor.noise_fraction = noise;
      const uint64_t seed = job.seed * 1000003 + n;
      JudgedLimit one{e, noise, limit_of(*network, e, sensor, seed), 0};
      one.truth.pressure_Pa.clear();
      for (uint32_t repeat = 0; repeat < job.repeats; ++repeat) {
        const Observation seen = sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, sensor,
                                                    seed + (repeat + 1) * 0x9e3779b1ULL);
        one.evidence = network->estimate(seen, Method::Refined).detection_statistic;
        judged.push_back(one);
      }
    }
  }
  return judged;
}

std::string limits_text(const std::vector<JudgedLimit>& judged) {
  std::string table = "size over limit     lumps    seen\n";
  for (const LimitRow& row : rows_of(judged)) {
    const std::string range = row.to < 1e-6     ? "no limit"
                              : row.to > 1e6    ? text("%.3g and more", row.from)
                              : row.from < 1e-6 ? text("below %.3g", row.to)
                                                : text("%.3g to %.3g", row.from, row.to);
    table += text("%-16s %8zu", range.c_str(), row.lumps) +
             (row.lumps > 0
                  ? text("%6.0f %%\n", 100.0 * static_cast<double>(row.seen) / static_cast<double>(row.lumps))
                  : std::string("\n"));
  }
  return table;
}

std::string limits_csv(const std::vector<JudgedLimit>& judged) {
  std::string csv = "shape,size_mm,depth_mm,stiffness_ratio,noise_fraction,limit_mm,evidence\n";
  for (const JudgedLimit& j : judged)
    csv += std::string(to_string(j.truth.shape)) +
           text(",%.4g,%.4g,%.4g,%.4g,", j.truth.size_mm, j.truth.depth_mm, j.truth.stiffness_ratio,
                j.noise_fraction) +
           (std::isnan(j.limit_mm) ? std::string() : text("%.4g", j.limit_mm)) + text(",%.4g\n", j.evidence);
  return csv;
}

json::Value limits_json(const std::vector<JudgedLimit>& judged) {
  json::Value rows = json::Value::array();
  for (const LimitRow& row : rows_of(judged))
    rows.push_back({{"size_over_limit", {row.from, row.to}}, {"lumps", row.lumps}, {"seen", row.seen}});
  return {{"rows", rows}};
}

}  // namespace palpate::lump
