#include "engine/lump/network/network.h"

#include <chrono>

#include "engine/lump/network/fit.h"
#include "engine/lump/network/second_bump.h"
#include "engine/lump/observation/saturated_loads.h"

namespace palpate {

LumpEstimate LumpNetwork::estimate(const LumpReading& reading, LumpMethod method) const {
  const auto start = std::chrono::steady_clock::now();
  LumpEstimate estimate;
  estimate.method = method == LumpMethod::Network ? "network" : "refined";
  const auto seen = without_saturated_loads(reading, estimate);
  if (const auto nodes = seen ? pressed_nodes(*model_, *seen, estimate) : std::nullopt) {
    const double warmth = trust_at(*model_, method, nodes->loads.size(), nodes->noise_share).warmth;
    conclude(*model_, *nodes, method, weigh_lumps(*model_, *nodes, method, warmth), estimate);
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
  for (const LumpMethod method : {LumpMethod::Network, LumpMethod::Refined})
    for (size_t l = 0; l < kTrustLoads.size(); ++l)
      for (size_t n = 0; n < kTrustNoise.size(); ++n) {
        const LumpTrust& t = model_->trust[static_cast<size_t>(method)][l][n];
        rows.push_back({method, kTrustLoads[l], kTrustNoise[n], t.stretch, t.evidence, t.misfit,
                        t.median_error, t.shape_rate});
      }
  return rows;
}

}  // namespace palpate
