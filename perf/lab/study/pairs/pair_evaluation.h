// How good estimates of two lumps in one block are, by how far apart they lie.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/lump/estimator.h"
#include "engine/lump/observation/sensor_model.h"
#include "perf/lab/dataset/file.h"

namespace palpate::lump {

struct PairJob {
  Estimator estimator;
  PalpationSensor sensor;
  uint32_t loads = 0;    ///< the last of each block, evenly; 0: all
  uint32_t repeats = 1;  ///< readings of each block
  uint64_t seed = 1;
};

/// One reading of a block with two lumps.
struct JudgedPair {
  uint32_t number = 0;  ///< of the block in its sweep
  std::array<Case::Lump, 2> truth;
  Estimate estimate;
  /// Of each true lump: which of Estimate::lumps lies nearest, each taken once.
  std::array<size_t, 2> answer{};

  double distance_mm() const;         ///< from centre to centre
  double distance_over_size() const;  ///< over the mean diameter
  bool told() const { return estimate.lumps.size() == 2; }
};

/// Blocks with two lumps; others are left out. Deterministic by seed.
std::vector<JudgedPair> judge_pairs(const Data& data, const PairJob& job);

std::string pairs_text(const std::vector<JudgedPair>& judged);
std::string pairs_csv(const std::vector<JudgedPair>& judged);
json::Value pairs_json(const std::vector<JudgedPair>& judged);

}  // namespace palpate::lump
