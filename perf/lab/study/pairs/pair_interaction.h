// What two lumps in one block do to each other: pressure beyond the sum of both bumps, by finite elements.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "perf/lab/dataset/file.h"

namespace palpate::lump {

/// One block at one force, on straight cells: what both lumps add less what each adds alone.
struct Interaction {
  uint32_t number = 0;  ///< of the block in its sweep
  double distance_over_size = 0, force_N = 0;
  double share = 0;      ///< its largest value over the higher bump's
  double over_both = 0;  ///< its RMS over that of the root of both bumps' product
};

/// The blocks with two lumps, at their last force and at half of it, on so many cells along the block.
std::vector<Interaction> measure_interaction(const Data& data, uint32_t cells);

std::string interaction_text(const std::vector<Interaction>& measured);
json::Value interaction_json(const std::vector<Interaction>& measured);

}  // namespace palpate::lump
