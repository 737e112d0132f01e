// Changes between two days that differ in more than the lump: another pad, a turned map, another calibration,
// another modulus told.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/lump/change/change.h"
#include "engine/lump/observation/sensor_model.h"
#include "perf/lab/study/days/change_evaluation.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

/// What differs on the second day.
struct DayExtreme {
  std::string name;
  PalpationSensor first, second;
  double pressure_factor = 1;                   ///< of the second day's calibration: told over true
  std::array<double, 2> young_factor = {1, 1};  ///< moduli told over true, of both days
  bool turned = false;                          ///< the second day's map by 180 degrees, of which nobody told
};
/// Around one sensor for both days: see README.md of engine/lump/change.
std::vector<DayExtreme> day_extremes(const PalpationSensor& sensor);

/// One extreme's pairs, of lumps that have not changed or that have all grown.
struct ExtremeRow {
  std::string name;
  bool grown = false;
  size_t pairs = 0, compared = 0;
  size_t told_grown = 0, told_shrunk = 0;
  std::array<size_t, 3> hold{};   ///< intervals of the factors of size, depth and ratio
  std::array<double, 3> error{};  ///< of these factors, median; NaN where none was compared
  size_t unexplained = 0;         ///< not comparable without a reason
  std::string reason;             ///< the first reason of a pair that is not comparable
};

/// Pairs of `first` and `second` (see pair_days()) under each extreme, places as ChangeJob has them; `grown`:
/// the second day's lumps are. Deterministic by seed. Fewer where progress() said stop.
std::vector<ExtremeRow> judge_extremes(const std::vector<Example>& first, const std::vector<Example>& second,
                                       const std::vector<DayExtreme>& extremes, bool grown,
                                       const ChangeJob& job);

std::string extremes_text(const std::vector<ExtremeRow>& rows);
std::string extremes_csv(const std::vector<ExtremeRow>& rows);
json::Value extremes_json(const std::vector<ExtremeRow>& rows);

}  // namespace palpate::lump
