#include "viz/commands/lump/method.h"

#include <utility>

#include "palpate/error.h"

namespace palpate {

std::shared_ptr<const LumpNetwork> lump_network(const std::string& file) {
  return std::make_shared<const LumpNetwork>(file.empty() ? LumpNetwork::built_in()
                                                          : LumpNetwork::read(file));
}

LumpEstimator lump_estimator(const std::string& method, std::shared_ptr<const LumpNetwork> network,
                             uint32_t threads) {
  if (method == "direct") return direct_estimator(std::move(network), threads);
  if (method != "network" && method != "refined")
    throw Error(Failure::Usage, "--method network, refined or direct", "'" + method + "'",
                "--method network");
  const LumpMethod how = method == "network" ? LumpMethod::Network : LumpMethod::Refined;
  return [network = std::move(network), how](const LumpReading& reading) {
    return network->estimate(reading, how);
  };
}

}  // namespace palpate
