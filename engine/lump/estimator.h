// Estimators of the lump behind an observation, by the name of their method.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "engine/base/stop.h"
#include "engine/lump/error_sources.h"
#include "engine/lump/network/network.h"

namespace palpate::lump {

/// How an estimate runs that takes long.
struct LongRun {
  uint32_t threads = 0;  ///< 0: one per core
  /// Asked many times a second, within the direct inversion too: it throws Stopped once this says so.
  StopAsked stop = {};
  /// Limit of what finite elements do for one reading, in cells times iterations; 0: none. Not in seconds, so
  /// that answers are the same on every machine. Each takes 0.13 us of two cores: 30 s.
  double most_work = 2.3e8;
};

/// The direct inversion, started where a network says, for each shape that it gives 5 % and more, and held
/// against its intervals. Where it reaches its limit of work before it has converged the network's answer
/// stands, or its intervals are added, and a reason says so. 1 to 30 s an observation of two cores.
Inverse direct_inverse(std::shared_ptr<const Network> network, const LongRun& run = {});

/// The file's network, or the built-in one where there is no file.
std::shared_ptr<const Network> load_network(const std::string& file);

/// "network", "refined" (its answer, refined by least squares) or "direct", which asks the network where to
/// start; the network finds how far errors move the direct inversion. Throws Error(Failure::Usage) for
/// others.
Estimator named_estimator(const std::string& method, std::shared_ptr<const Network> network,
                          const ErrorSources& sources, const LongRun& run = {});

}  // namespace palpate::lump
