// How stiff pressed blocks are, with and without a lump: the fit behind BlockStiffness, and its errors.
#pragma once

#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/lump/tissue/block_stiffness.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

/// Least squares over all loads of blocks of both kinds. Throws Error(Failure::Input) for fewer blocks of a
/// kind than terms.
BlockStiffness fit_stiffness(const std::vector<Example>& examples);

/// Errors of a fit on known blocks.
struct StiffnessErrors {
  size_t plain = 0, lumps = 0;                    ///< blocks
  double plain_rms = 0, plain_worst = 0;          ///< of the force's logarithm, blocks without a lump
  double lump_rms = 0, lump_worst = 0;            ///< of what a lump adds, share of it
  double with_lump_rms = 0, with_lump_worst = 0;  ///< of the force's logarithm, blocks with one
  double added_median = 0, added_most = 0;        ///< what lumps add to the force's logarithm
};
StiffnessErrors judge_stiffness(const BlockStiffness& fit, const std::vector<Example>& examples);

std::string stiffness_text(const StiffnessErrors& errors);
json::Value stiffness_json(const StiffnessErrors& errors);
/// The numbers as engine/lump/tissue/block_stiffness.inc has them.
std::string stiffness_numbers(const BlockStiffness& fit);

}  // namespace palpate::lump
