// Who tells what lies behind an observation.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "engine/lump/network/network.h"

namespace palpate::lump {

using Estimator = std::function<Estimate(const Observation&)>;

/// The direct inversion, started where a network says, for each shape that it gives 10 % and more, and held
/// against its intervals. About a minute an observation and shape. `threads` 0: one per core.
Estimator direct_estimator(std::shared_ptr<const Network> network, uint32_t threads = 0);

/// The file's network, or the built-in one where there is no file.
std::shared_ptr<const Network> load_network(const std::string& file);

/// "network", "refined" (its answer, refined by least squares) or "direct", which asks the network where to
/// start. Throws Error(Failure::Usage) for others. `threads` as for direct_estimator.
Estimator named_estimator(const std::string& method, std::shared_ptr<const Network> network,
                          uint32_t threads = 0);

}  // namespace palpate::lump
