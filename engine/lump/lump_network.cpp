#include "engine/lump/lump_network.h"

#include <chrono>

#include "engine/lump/lump_fit.h"
#include "engine/lump/saturated_loads.h"
#include "engine/lump/second_bump.h"

namespace palpate {

LumpEstimate LumpNetwork::estimate(const LumpReading& reading) const {
  const auto start = std::chrono::steady_clock::now();
  LumpEstimate estimate;
  estimate.method = "network";
  const auto seen = without_saturated_loads(reading, estimate);
  if (const auto nodes = seen ? pressed_nodes(*model_, *seen, estimate) : std::nullopt) {
    const double warmth = trust_at(*model_, nodes->loads.size(), nodes->noise_share).warmth;
    conclude(*model_, *nodes, weigh_lumps(*model_, *nodes, warmth), estimate);
    tell_second_bump(*nodes, estimate);
  }
  estimate.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return estimate;
}

std::string LumpNetwork::made_from() const {
  return model_->made_from;
}

std::vector<LumpTrustRow> LumpNetwork::trust() const {
  std::vector<LumpTrustRow> rows;
  for (size_t l = 0; l < kTrustLoads.size(); ++l)
    for (size_t n = 0; n < kTrustNoise.size(); ++n) {
      const LumpTrust& t = model_->trust[l][n];
      rows.push_back({kTrustLoads[l], kTrustNoise[n], t.stretch, t.evidence, t.misfit});
    }
  return rows;
}

}  // namespace palpate
