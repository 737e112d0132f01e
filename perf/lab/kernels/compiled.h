// Compiler statistics of every kernel for a GPU, on a machine without that GPU: Mesa's Radeon driver
// compiles for any of its families.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "perf/profile/report/tables.h"

namespace palpate::perf {

struct CompiledKernel {
  std::string name;
  std::array<uint32_t, 3> local_size{};
  std::vector<uint32_t> constants;  ///< specialisation constants 3, 4, ...
  std::map<std::string, double>
      values;  ///< by the driver's names: "VGPRs", "Spilled VGPRs", "Instructions", ...
};

/// GPU families whose kernels are compiled by default; the driver supports others too.
inline constexpr std::array kFamilies{"navi21", "gfx1100", "vega10", "polaris10"};

/// Every kernel of the frame pipeline, of the sensors of all kinds, and of the forward model, with the tuning
/// that GPUs start from. Runs in a process of its own, since the driver crashes at exit without its hardware:
/// call it before any other use of Vulkan. Throws Error(Failure::Device) where the driver is missing or does
/// not support `family`.
std::vector<CompiledKernel> compile_for(const std::string& family);

/// One row a kernel, those that spill first, then by estimated latency.
Table table_of(const std::string& family, const std::vector<CompiledKernel>& kernels);
json::Value to_json(const std::map<std::string, std::vector<CompiledKernel>>& families);
std::string to_csv(const std::map<std::string, std::vector<CompiledKernel>>& families);

}  // namespace palpate::perf
