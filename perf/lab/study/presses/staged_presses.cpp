#include "perf/lab/study/presses/staged_presses.h"

#include "engine/palpation/hand/hand_simulation.h"

namespace palpate::lump {

PressedTissue tissue_of(const Example& e, double hardest_N) {
  const double scale = hardest_N / e.force_N.back();
  PressedTissue tissue{e.block_mm, e.young_Pa * scale, e.pressure_Pa, e.force_N, e.press_mm};
  for (double& force_N : tissue.force_N) force_N *= scale;
  for (PressureMap& map : tissue.pressure_Pa)
    for (float& value : map.values) value *= static_cast<float>(scale);
  return tissue;
}

std::vector<ScanPress> staged_presses(const PressedTissue& tissue,
                                      const std::vector<std::array<double, 2>>& places_mm, double top_N,
                                      const PalpationSensor& sensor, uint64_t seed) {
  std::vector<ScanPress> presses;
  for (const auto& place_mm : places_mm) {
    HandPlan plan;
    plan.aims_mm = {place_mm};
    plan.aim_sd_mm = plan.first_sd_mm = kStudyStage_mm;
    plan.skill = {0, 0, 0};
    plan.relief_mm = 0;
    plan.relief_pitch_mm = 0.5;
    plan.force_N = {top_N, top_N};
    plan.sensor = sensor;
    plan.seed = 101 * seed + presses.size();
    HandPress press = std::move(simulate_hand(tissue, plan)[0]);
    press.observation.window_mm = place_mm;
    presses.push_back({"press " + std::to_string(presses.size() + 1), std::move(press.observation), 0});
  }
  return presses;
}

}  // namespace palpate::lump
