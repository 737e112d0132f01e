#include "viz/commands/lump/method.h"

#include <utility>

#include "palpate/error.h"

namespace palpate {

std::shared_ptr<const lump::Network> lump_network(const std::string& file) {
  return std::make_shared<const lump::Network>(file.empty() ? lump::Network::built_in()
                                                            : lump::Network::read(file));
}

lump::Estimator lump_estimator(const std::string& method, std::shared_ptr<const lump::Network> network,
                               uint32_t threads) {
  if (method == "direct") return direct_estimator(std::move(network), threads);
  if (method != "network" && method != "refined")
    throw Error(Failure::Usage, "--method network, refined or direct", "'" + method + "'",
                "--method network");
  const lump::Method how = method == "network" ? lump::Method::Network : lump::Method::Refined;
  return [network = std::move(network), how](const lump::Observation& observation) {
    return network->estimate(observation, how);
  };
}

}  // namespace palpate
