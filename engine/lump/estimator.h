// Estimators of the lump behind an observation, by the name of their method.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "engine/lump/error_sources.h"
#include "engine/lump/network/network.h"

namespace palpate::lump {

/// The direct inversion, started where a network says, for each shape that it gives 10 % and more, and held
/// against its intervals. About a minute an observation and shape. `threads` 0: one per core.
Inverse direct_inverse(std::shared_ptr<const Network> network, uint32_t threads = 0);

/// The file's network, or the built-in one where there is no file.
std::shared_ptr<const Network> load_network(const std::string& file);

/// "network", "refined" (its answer, refined by least squares) or "direct", which asks the network where to
/// start; the network finds how far errors move the direct inversion. Throws Error(Failure::Usage) for
/// others. `threads` as for direct_inverse.
Estimator named_estimator(const std::string& method, std::shared_ptr<const Network> network,
                          const ErrorSources& sources, uint32_t threads = 0);

}  // namespace palpate::lump
