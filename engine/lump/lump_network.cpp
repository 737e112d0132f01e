#include "engine/lump/lump_network.h"

#include <chrono>

#include "engine/lump/lump_fit.h"

namespace palpate {

LumpEstimate LumpNetwork::estimate(const LumpReading& reading) const {
  const auto start = std::chrono::steady_clock::now();
  LumpEstimate estimate;
  estimate.method = "network";
  if (const auto nodes = pressed_nodes(*model_, reading, estimate)) {
    const double warmth = trust_at(*model_, nodes->loads.size(), nodes->noise_share).warmth;
    conclude(*model_, *nodes, weigh_lumps(*model_, *nodes, warmth), estimate);
  }
  estimate.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return estimate;
}

}  // namespace palpate
