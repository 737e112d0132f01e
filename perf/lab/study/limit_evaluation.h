// How true limits of detection are: known blocks at several noises, seen or not, by how far each lump's size
// lies above the limit at its depth, stiffness and place.
#pragma once

#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/lump/observation/sensor_model.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

struct LimitJob {
  PalpationSensor sensor;
  std::vector<double> noise_fractions = {0.002, 0.01, 0.03};  ///< of the highest load's peak
  uint32_t repeats = 4;                                       ///< of each block and noise
  uint64_t seed = 1;
};

struct JudgedLimit {
  Example truth;  ///< without its maps
  double noise_fraction = 0;
  double limit_mm = 0;  ///< NaN: no lump is seen there
  double evidence = 0;
  bool seen() const { return evidence >= 1; }
  /// The size over the limit; 0 where none is seen.
  double over_limit() const;
};

/// Blocks with a ball or an upright cylinder. Deterministic by seed.
std::vector<JudgedLimit> judge_limits(const std::vector<Example>& examples, const LimitJob& job);

std::string limits_text(const std::vector<JudgedLimit>& judged);
std::string limits_csv(const std::vector<JudgedLimit>& judged);
json::Value limits_json(const std::vector<JudgedLimit>& judged);

}  // namespace palpate::lump
