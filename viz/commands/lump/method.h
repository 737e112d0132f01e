// Methods that estimate a lump, by their names on the command line.
#pragma once

#include <memory>
#include <string>

#include "engine/lump/estimator.h"
#include "engine/lump/network/network.h"

namespace palpate {

/// Values of --method, for its help.
inline constexpr const char* kLumpMethodHelp =
    "Who estimates: network, refined (its answer, refined by least squares; half as far off), direct (finite "
    "elements, a minute or so)";

/// The file's network, or the built-in one where there is no file.
std::shared_ptr<const lump::Network> lump_network(const std::string& file);

/// "network", "refined" or "direct", which asks the network where to start. Throws Error(Failure::Usage) for
/// others. `threads` is for the finite elements; 0: one per core.
lump::Estimator lump_estimator(const std::string& method, std::shared_ptr<const lump::Network> network,
                               uint32_t threads = 0);

}  // namespace palpate
