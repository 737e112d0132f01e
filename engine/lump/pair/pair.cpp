#include "engine/lump/pair/pair.h"

#include <chrono>
#include <utility>

#include "engine/lump/network/view.h"
#include "engine/lump/observation/saturated_loads.h"
#include "engine/lump/pair/merged.h"
#include "engine/lump/pair/pair_fit.h"

namespace palpate::lump {

void estimate_pair(const Model& model, const Observation& observation, Estimate& estimate) {
  const bool two = estimate.verdict == Status::SeveralLumps && estimate.bumps_mm.size() == 2;
  if (!two && estimate.verdict != Status::OutsideTraining) return;
  const auto start = std::chrono::steady_clock::now();
  Estimate inputs;  // for its reasons
  const auto seen = without_saturated_loads(observation, inputs);
  const auto nodes = seen ? pressed_nodes(model, *seen, inputs) : std::nullopt;
  if (!nodes) return;
  if (two) {
    const double temperature =
        calibration_at(model, Method::Refined, nodes->loads.size(), nodes->noise_fraction).temperature;
    const PairWeighing pair =
        weigh_pair(model, *nodes, {{estimate.bumps_mm[0], estimate.bumps_mm[1]}}, temperature);
    for (const Inference& each : pair.lumps) {
      Estimate& lump = estimate.lumps.emplace_back();
      lump.method = "refined";
      summarise(model, *nodes, Method::Refined, each, lump);
    }
    // Reasons of one lump alone are none any more; where the bumps are comes first.
    inputs.reasons.insert(inputs.reasons.begin(), estimate.reasons.front());
    estimate.reasons = std::move(inputs.reasons);
    clear_values(estimate);
  } else {
    report_merged(model, *nodes, estimate);
  }
  estimate.wall_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace palpate::lump
