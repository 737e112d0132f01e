// Error against run time of every way to estimate a lump: methods, and numbers of loads.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/lump/estimator.h"
#include "perf/lab/study/evaluation.h"

namespace palpate::lump {

/// One way, on all blocks.
struct MethodCost {
  std::string method;                ///< as named_estimator() has them
  uint32_t loads = 4;                ///< the highest so many
  size_t lumps = 0, judged = 0;      ///< of those that were seen
  std::array<double, 3> median{};    ///< relative errors of size, depth and ratio (of 2 to 20)
  double cpu_s = 0, slowest_s = 0;   ///< of processor, all threads together: median and most
  std::array<double, 3> coverage{};  ///< of 90 % intervals
};

/// The examples by the network and refined at one, two and four loads, and by the direct inversion at four.
/// `run`: of the direct inversion; blocks are read one after another, so that times are those of a reading
/// alone. `progress` hears how many of kEstimateWays are done. Those that run.stop cuts short are left out.
std::vector<MethodCost> method_costs(const std::vector<Example>& examples, const EvaluationJob& job,
                                     const LongRun& run, const std::function<void(size_t done)>& progress);
inline constexpr size_t kEstimateWays = 7;

std::string method_costs_text(const std::vector<MethodCost>& costs);
std::string method_costs_csv(const std::vector<MethodCost>& costs);
json::Value method_costs_json(const std::vector<MethodCost>& costs);

}  // namespace palpate::lump
