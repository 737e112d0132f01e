// Who tells what lies behind an observation.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "engine/lump/network/network.h"

namespace palpate::lump {

using Estimator = std::function<Estimate(const Observation&)>;

/// The direct inversion, started where a network says, for each shape that it gives 10 % and more, and held
/// against its intervals. About a minute an observation and shape. `threads` 0: one per core.
Estimator direct_estimator(std::shared_ptr<const Network> network, uint32_t threads = 0);

}  // namespace palpate::lump
