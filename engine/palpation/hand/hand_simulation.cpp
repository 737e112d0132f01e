#include "engine/palpation/hand/hand_simulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/palpation/scan.h"
#include "engine/tissue/map_sampling.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// Nodes whose cells reach beyond the block are not seen.
void hide_beside(const PressedTissue& tissue, const HeldPose& pose, PressureMap& map) {
  for (uint32_t j = 0; j < map.height; ++j)
    for (uint32_t i = 0; i < map.width; ++i)
      for (const double a : {-0.5, 0.5})
        for (const double b : {-0.5, 0.5}) {
          const auto [x, y] = pose.block((i + a - (map.width - 1) / 2.0) * map.pitch_mm[0],
                                         (j + b - (map.height - 1) / 2.0) * map.pitch_mm[1]);
          if (std::abs(x) > tissue.block_mm[0] / 2 || std::abs(y) > tissue.block_mm[1] / 2)
            map.values[size_t{j} * map.width + i] = static_cast<float>(kNaN);
        }
}

SkinRelief relief_of(const PressedTissue& tissue, const HandPlan& plan, const SkinTexture& skin,
                     const HeldPose& pose, double force_N, const PressureMap& pressure,
                     std::mt19937_64& random) {
  SkinRelief r;
  r.pitch_mm = plan.relief_pitch_mm;
  r.width = static_cast<uint32_t>(plan.sensor.window_mm[0] / r.pitch_mm);
  r.height = static_cast<uint32_t>(plan.sensor.window_mm[1] / r.pitch_mm);
  r.force_N = force_N;
  std::normal_distribution<double> normal;
  // Noise of 3 px reach: means of white noise on a coarser grid.
  PressureMap slow{r.width / 3 + 2, r.height / 3 + 2, {3, 3}, {}};
  for (size_t i = 0; i < size_t{slow.width} * slow.height; ++i)
    slow.values.push_back(static_cast<float>(plan.relief_noise_mm * normal(random)));
  for (uint32_t j = 0; j < r.height; ++j)
    for (uint32_t i = 0; i < r.width; ++i) {
      const double u = i - (r.width - 1) / 2.0, v = j - (r.height - 1) / 2.0;
      const auto [x, y] = pose.block(u * r.pitch_mm, v * r.pitch_mm);
      const bool on = std::abs(x) <= tissue.block_mm[0] / 2 && std::abs(y) <= tissue.block_mm[1] / 2;
      const auto place = skin_place(tissue, pose, force_N, x, y);
      const double depth =
          on ? 0.1 + skin.at(place[0], place[1]) +
                   1e-6 * plan.pad_mm_per_MPa * map_at(pressure, u * r.pitch_mm, v * r.pitch_mm)
             : 0;
      r.depth_mm.push_back(
          static_cast<float>(depth + plan.relief_noise_mm * normal(random) + map_at(slow, u, v)));
      r.contact.push_back(on ? 1 : 0);
    }
  return r;
}

void check(const PressedTissue& tissue, const HandPlan& plan, double top_N) {
  if (tissue.force_N.size() < 2 || tissue.pressure_Pa.size() != tissue.force_N.size() ||
      tissue.press_mm.size() != tissue.force_N.size() || tissue.force_N.back() < top_N)
    throw Error(Failure::Usage, text("a block that was pressed at two loads or more up to %.3g N", top_N),
                tissue.force_N.empty() ? "none"
                                       : text("%zu up to %g N", tissue.force_N.size(), tissue.force_N.back()),
                "a smaller force of the hand");
  if (!(plan.force_N[0] > 0 && plan.force_N[0] <= plan.force_N[1]) || plan.loads < 1 || plan.loads > 8 ||
      !(plan.skill.tilt_deg >= 0 && plan.skill.tilt_deg <= 15) ||
      !(plan.skill.turn_deg >= 0 && plan.skill.turn_deg <= 45) ||
      !(plan.relief_pitch_mm >= 0.05 && plan.relief_pitch_mm <= 0.5))
    throw Error(
        Failure::Usage,
        "forces above 0, 1 to 8 loads, tilts to 15 and turns to 45 degrees, a relief of 0.05 to 0.5 mm",
        text("%g to %g N, %u loads, %g and %g degrees, %g mm", plan.force_N[0], plan.force_N[1], plan.loads,
             plan.skill.tilt_deg, plan.skill.turn_deg, plan.relief_pitch_mm),
        "forces of 1 and 3 N");
}

}  // namespace

std::vector<HandPress> simulate_hand(const PressedTissue& tissue, const HandPlan& plan,
                                     std::vector<HandTruth>* truth) {
  std::mt19937_64 random(plan.seed * 6364136223846793005ULL + 1442695040888963407ULL);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even(-1, 1);
  const auto aims = plan.aims_mm.empty() ? hand_aims(tissue.block_mm, plan.sensor.window_mm) : plan.aims_mm;
  const SkinTexture skin(plan.relief_mm, {0.5, 3}, random);
  std::vector<double> highest_N;
  for (size_t p = 0; p < aims.size(); ++p)
    highest_N.push_back(plan.force_N[0] + (plan.force_N[1] - plan.force_N[0]) * (even(random) + 1) / 2);
  const double top_N = *std::min_element(highest_N.begin(), highest_N.end());
  check(tissue, plan, top_N);

  std::vector<HandPress> presses;
  if (truth) truth->clear();
  for (size_t p = 0; p < aims.size(); ++p) {
    const double sd = p == 0 ? plan.first_sd_mm : plan.aim_sd_mm;
    HandSkill skill = plan.skill;
    if (p == 0) skill.turn_deg /= 3;
    const HeldPress held = held_press(skill, aims[p], sd, random);
    const auto trembling = [&](double force_N) { return held.at(plan.press_s * force_N / highest_N[p]); };
    std::vector<double> forces_N;
    std::vector<PressureMap> maps;
    for (uint32_t k = 1; k <= plan.loads; ++k) {
      forces_N.push_back(std::min(highest_N[p], hand_load(top_N, k, plan.loads) * (1 + 0.02 * even(random))));
      maps.push_back(
          pressure_under(tissue, trembling(forces_N.back()), forces_N.back(), plan.sensor.window_mm));
    }
    HandPress press;
    press.name = "press " + std::to_string(p + 1);
    lump::PalpationSensor sensor = plan.sensor;
    sensor.window_center_mm = {0, 0};
    press.observation = lump::sensor_observation(maps, forces_N, {1000, 1000, tissue.block_mm[2]},
                                                 tissue.young_Pa, sensor, plan.seed * 1000 + p);
    press.observation.block_mm = tissue.block_mm;
    const HeldPose seen = trembling(forces_N.back());
    for (PressureMap& map : press.observation.pressure_Pa) hide_beside(tissue, seen, map);
    press.relief = relief_of(tissue, plan, skin, seen, forces_N.back(), maps.back(), random);
    presses.push_back(std::move(press));
    if (!truth) continue;
    HandTruth t{seen.at_mm, seen.turn_rad, seen.tilt_rad, highest_N[p]};
    truth->push_back(t);
  }
  return presses;
}

}  // namespace palpate
