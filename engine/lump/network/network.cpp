#include "engine/lump/network/network.h"

#include <chrono>

#include "engine/lump/network/consistency.h"
#include "engine/lump/network/fit.h"
#include "engine/lump/network/second_bump.h"
#include "engine/lump/observation/saturated_loads.h"

namespace palpate::lump {

Estimate Network::estimate(const Observation& observation, Method method) const {
  const auto start = std::chrono::steady_clock::now();
  Estimate estimate;
  estimate.method = method == Method::Network ? "network" : "refined";
  const auto seen = without_saturated_loads(observation, estimate);
  const auto nodes = seen ? pressed_nodes(*model_, *seen, estimate) : std::nullopt;
  if (nodes) {
    const double temperature =
        calibration_at(*model_, method, nodes->loads.size(), nodes->noise_fraction).temperature;
    summarise(*model_, *nodes, method, weigh_lumps(*model_, *nodes, method, temperature), estimate);
    report_second_bump(*nodes, estimate);
  }
  if (seen) report_contradictions(*model_, *seen, nodes ? &*nodes : nullptr, estimate);
  estimate.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return estimate;
}

std::string Network::made_from() const {
  return model_->made_from;
}

std::vector<CalibrationRow> Network::calibration() const {
  std::vector<CalibrationRow> rows;
  for (const Method method : {Method::Network, Method::Refined})
    for (size_t l = 0; l < kCalibrationLoads.size(); ++l)
      for (size_t n = 0; n < kCalibrationNoise.size(); ++n) {
        const Calibration& t = model_->calibration[static_cast<size_t>(method)][l][n];
        rows.push_back({method, kCalibrationLoads[l], kCalibrationNoise[n], t.inflation,
                        t.log_likelihood_ratio, t.misfit, t.median_error, t.shape_rate});
      }
  return rows;
}

}  // namespace palpate::lump
