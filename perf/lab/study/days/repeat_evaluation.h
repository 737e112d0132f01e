// Repeatability: a known block pressed again and again, and how far its estimates spread, over the errors
// that they state.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/lump/change/change.h"
#include "engine/lump/estimator.h"
#include "engine/lump/observation/sensor_model.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

struct RepeatJob {
  Estimator estimator;  ///< its sources cover the window's place
  PalpationSensor sensor;
  uint32_t presses = 20;     ///< of each block, an even number
  double place_mm = 2;       ///< to either side, evenly: where the window lies untold, along each axis
  double place_sd_mm = 1.2;  ///< told, of each window
  double load_share = 0.1;   ///< to either side, evenly: of a press's loads against the nominal ones
  uint64_t seed = 1;
  uint32_t threads = 1;
  std::function<bool(size_t done)> progress = {};  ///< from one thread at a time; false: stop
};

/// One block's presses.
struct RepeatedBlock {
  size_t number = 0;                ///< of the example among all
  Example truth;                    ///< without its maps
  std::vector<Estimate> estimates;  ///< one a press
  std::vector<LumpChange> changes;  ///< from each press with an even number to the one after it: none is true
};

/// Spread of readings next to the errors that they state; of logarithms of size, depth and ratio. NaN where
/// fewer than two are there.
struct Spread {
  size_t readings = 0;
  std::array<double, 3> spread{}, stated{};  ///< standard deviations
  std::array<double, 3> over_stated() const;
};
/// Of the estimates that report numbers about their mean.
Spread estimates_spread(const RepeatedBlock& block);
/// Of the changes from press to press, about none.
Spread changes_spread(const RepeatedBlock& block);

/// Presses each example so often, at four loads even from a quarter of the highest on: maps between the
/// example's loads (six or more of them) are interpolated. Blocks without a lump are left out. Deterministic
/// by seed, whatever the number of threads. Throws Error(Failure::Input) for examples of fewer loads.
std::vector<RepeatedBlock> judge_repeats(const std::vector<Example>& examples, const RepeatJob& job);

std::string repeats_text(const std::vector<RepeatedBlock>& blocks);
/// A row a block.
std::string repeats_csv(const std::vector<RepeatedBlock>& blocks);
json::Value repeats_json(const std::vector<RepeatedBlock>& blocks);

}  // namespace palpate::lump
