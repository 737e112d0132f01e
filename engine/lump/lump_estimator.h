// Who tells what lies behind a reading.
#pragma once

#include <cstdint>
#include <functional>

#include "engine/lump/lump_reading.h"

namespace palpate {

using LumpEstimator = std::function<LumpEstimate(const LumpReading&)>;

/// The direct inversion, started where the built-in network says, for the shape that it says. About a
/// minute a reading. `threads` 0: one per core.
LumpEstimator direct_estimator(uint32_t threads = 0);

}  // namespace palpate
