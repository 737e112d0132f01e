// How good changes between two days are: known blocks, pressed on two days, judged against the truth.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/lump/change/change.h"
#include "engine/lump/observation/sensor_model.h"
#include "perf/lab/judge/cases.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

struct ChangeJob {
  PalpationSensor sensor;
  /// Windows lie where nobody told; all else is exact.
  ErrorSources sources = {.young = 0, .thickness = 0, .pitch = 0, .light = false, .place = true};
  double place_mm =
      2;  ///< to either side, evenly: where the second day's window lies untold, along each axis
  double place_sd_mm = 1.2;  ///< told, of each window
  uint32_t repeats = 1;      ///< of each pair, with other noise, places and errors of the gauge
  uint64_t seed = 1;
  uint32_t threads = 1;
  std::function<bool(size_t done)> progress = {};  ///< from one thread at a time; false: stop
};

struct JudgedChange {
  Example first, second;  ///< without their maps
  Day a, b;               ///< estimates alone
  LumpChange change;
  std::array<double, 3> truth() const;  ///< of size, depth and ratio, second over first
};

/// Leaves the blocks that are on both days, in the order of the first.
void pair_days(std::vector<Example>& first, std::vector<Example>& second);

/// Pairs of the two sets by their order. Deterministic by seed. Fewer than there are where progress() said
/// stop.
std::vector<JudgedChange> judge_changes(const std::vector<Example>& first, const std::vector<Example>& second,
                                        const ChangeJob& job);

/// Verdicts, errors beside those of two separate estimates, and how many intervals hold.
std::string changes_text(const std::vector<JudgedChange>& judged);
json::Value changes_json(const std::vector<JudgedChange>& judged);
judge::Cases cases_of(const std::vector<JudgedChange>& judged);

}  // namespace palpate::lump
