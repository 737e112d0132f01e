// Effect of wrong inputs: known blocks through a synthetic sensor, stated wrong on purpose, and the estimate
// that follows.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "perf/lab/study/evaluation.h"

namespace palpate::lump {

struct FaultRow {
  std::string fault;  ///< "pitch 1 for 1.25 mm", ...
  size_t blocks = 0;
  double inconsistent =
      0;               ///< share of the blocks whose estimate says that the observation contradicts itself
  double numbers = 0;  ///< share of those that report numbers all the same
  /// For lumps whose numbers are reported with and without the fault: how size, depth and ratio move, median
  /// of (with over without, less 1); NaN where there are none.
  std::array<double, 3> move{};
};

/// The job's examples, each with each fault, at the job's noise, gauge and loads. The first row draws honest
/// observations: window, noise (0.1 to 10 % of the peak), gauge (0.2 to 1 %) and loads at random, ten of each
/// block. Throws Stopped where progress() said stop.
std::vector<FaultRow> fault_rows(const std::vector<Example>& examples, const EvaluationJob& job);
/// How many faults there are: job.progress is told of count_judged() times as many readings.
size_t fault_count();

std::string faults_text(const std::vector<FaultRow>& rows);
std::string faults_csv(const std::vector<FaultRow>& rows);
json::Value faults_json(const std::vector<FaultRow>& rows);

}  // namespace palpate::lump
