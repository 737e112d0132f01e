// Who tells what lies behind a reading.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "engine/lump/network/network.h"

namespace palpate {

using LumpEstimator = std::function<LumpEstimate(const LumpReading&)>;

/// The direct inversion, started where a network says, for each shape that it gives 10 % and more, and held
/// against its intervals. About a minute a reading and shape. `threads` 0: one per core.
LumpEstimator direct_estimator(std::shared_ptr<const LumpNetwork> network, uint32_t threads = 0);

}  // namespace palpate
