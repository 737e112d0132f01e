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

constexpr double kDegree = std::numbers::pi / 180;

/// Waves in all directions, 0.5 to 3 mm long, alike in their logarithm.
class Skin {
 public:
  Skin(double rms_mm, std::mt19937_64& random) {
    constexpr int kWaves = 48;
    std::uniform_real_distribution<double> any(0, 1);
    for (int k = 0; k < kWaves; ++k) {
      const double way = 2 * std::numbers::pi * any(random), length = 0.5 * std::pow(6, any(random));
      const double number = 2 * std::numbers::pi / length;
      waves_.push_back({number * std::cos(way), number * std::sin(way), 2 * std::numbers::pi * any(random),
                        rms_mm * std::sqrt(2.0 / kWaves)});
    }
  }
  double at(double x_mm, double y_mm) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += w.height * std::sin(w.x * x_mm + w.y * y_mm + w.phase);
    return sum;
  }

 private:
  struct Wave {
    double x, y, phase, height;
  };
  std::vector<Wave> waves_;
};

/// Straight between the loads and on beyond the last; through 0 below the first.
double between(const std::vector<double>& from, const std::vector<double>& to, double at) {
  if (at <= from[0] || from.size() == 1) return to[0] * at / from[0];
  size_t k = 0;
  while (k + 2 < from.size() && from[k + 1] < at) ++k;
  return to[k] + (to[k + 1] - to[k]) * (at - from[k]) / (from[k + 1] - from[k]);
}

/// A level plate's pressure at a place of the block and a load.
double pressure_at(const PressedTissue& tissue, double x_mm, double y_mm, double force_N) {
  size_t k = 0;
  while (k + 2 < tissue.force_N.size() && tissue.force_N[k + 1] < force_N) ++k;
  const double a = tissue.force_N[k], b = tissue.force_N[k + 1], t = (force_N - a) / (b - a);
  return force_N * ((1 - t) * map_at(tissue.pressure_Pa[k], x_mm, y_mm) / a +
                    t * map_at(tissue.pressure_Pa[k + 1], x_mm, y_mm) / b);
}

/// One press while it is made.
struct HeldPose {
  std::array<double, 2> at_mm;
  double turn_rad;
  std::array<double, 2> tilt_rad;

  std::array<double, 2> block(double u, double v) const {
    const double c = std::cos(turn_rad), s = std::sin(turn_rad);
    return {at_mm[0] + c * u - s * v, at_mm[1] + s * u + c * v};
  }
};

/// The load of a level plate that is as deep as the tilted one at a place.
double local_load(const PressedTissue& tissue, const HeldPose& pose, double force_N, double x_mm,
                  double y_mm) {
  const double depth = between(tissue.force_N, tissue.press_mm, force_N);
  const double there =
      std::max(0.0, depth + std::tan(pose.tilt_rad[0]) * x_mm + std::tan(pose.tilt_rad[1]) * y_mm);
  return between(tissue.press_mm, tissue.force_N, there);
}

/// Mean of the local loads over the block, over the force: what the gauge reads is the whole.
double load_scale(const PressedTissue& tissue, const HeldPose& pose, double force_N) {
  double sum = 0;
  constexpr int kSide = 8;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      sum += local_load(tissue, pose, force_N, ((i + 0.5) / kSide - 0.5) * tissue.block_mm[0],
                        ((j + 0.5) / kSide - 0.5) * tissue.block_mm[1]);
  return force_N * kSide * kSide / sum;
}

/// Pressure under the window, its frame the pad's, on nodes finer than what is read.
PressureMap under_window(const PressedTissue& tissue, const HeldPose& pose, double force_N,
                         const std::array<double, 2>& window_mm) {
  constexpr double kUnder_mm = 0.6, kBeside_mm = 3;
  PressureMap map;
  map.pitch_mm = {kUnder_mm, kUnder_mm};
  map.width = window_nodes(window_mm[0] + kBeside_mm, kUnder_mm);
  map.height = window_nodes(window_mm[1] + kBeside_mm, kUnder_mm);
  const double scale = load_scale(tissue, pose, force_N);
  for (uint32_t j = 0; j < map.height; ++j)
    for (uint32_t i = 0; i < map.width; ++i) {
      const auto [x, y] =
          pose.block((i - (map.width - 1) / 2.0) * kUnder_mm, (j - (map.height - 1) / 2.0) * kUnder_mm);
      map.values.push_back(
          static_cast<float>(pressure_at(tissue, x, y, scale * local_load(tissue, pose, force_N, x, y))));
    }
  return map;
}

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

/// The skin's own place under a place of the pressed block: incompressible, wider by its mean compression,
/// and drawn aside where a tilted plate presses deeper.
std::array<double, 2> skin_place(const PressedTissue& tissue, const HeldPose& pose, double force_N, double x,
                                 double y) {
  const double height = tissue.block_mm[2], depth = between(tissue.force_N, tissue.press_mm, force_N);
  const double shrink = std::sqrt(1 - depth / height);
  const double a = pose.tilt_rad[0] / (4 * height), b = pose.tilt_rad[1] / (4 * height);
  return {shrink * (x - a * (x * x - y * y) - 2 * b * x * y),
          shrink * (y - b * (y * y - x * x) - 2 * a * x * y)};
}

SkinRelief relief_of(const PressedTissue& tissue, const HandPlan& plan, const Skin& skin,
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
      !(plan.tilt_deg >= 0 && plan.tilt_deg <= 15) || !(plan.turn_deg >= 0 && plan.turn_deg <= 45) ||
      !(plan.relief_pitch_mm >= 0.05 && plan.relief_pitch_mm <= 0.5))
    throw Error(
        Failure::Usage,
        "forces above 0, 1 to 8 loads, tilts to 15 and turns to 45 degrees, a relief of 0.05 to 0.5 mm",
        text("%g to %g N, %u loads, %g and %g degrees, %g mm", plan.force_N[0], plan.force_N[1], plan.loads,
             plan.tilt_deg, plan.turn_deg, plan.relief_pitch_mm),
        "forces of 1 and 3 N");
}

}  // namespace

std::vector<std::array<double, 2>> hand_aims(const std::array<double, 3>& block_mm,
                                             const std::array<double, 2>& window_mm) {
  std::vector<std::array<double, 2>> aims = scan_places(block_mm, window_mm, 0.5);
  // Rows in turn from the left and from the right.
  for (auto row = aims.begin(); row != aims.end();) {
    const auto end = std::find_if(row, aims.end(), [&](const auto& p) { return p[1] != (*row)[1]; });
    if (row != aims.begin() && std::hypot((*row)[0] - (*(row - 1))[0], (*row)[1] - (*(row - 1))[1]) >
                                   std::hypot((*(end - 1))[0] - (*(row - 1))[0], (*row)[1] - (*(row - 1))[1]))
      std::reverse(row, end);
    row = end;
  }
  if (aims.size() > 1) aims.insert(aims.begin(), {0, 0});
  return aims;
}

std::vector<HandPress> simulate_hand(const PressedTissue& tissue, const HandPlan& plan,
                                     std::vector<HandTruth>* truth) {
  std::mt19937_64 random(plan.seed * 6364136223846793005ULL + 1442695040888963407ULL);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even(-1, 1);
  const auto aims = plan.aims_mm.empty() ? hand_aims(tissue.block_mm, plan.sensor.window_mm) : plan.aims_mm;
  const Skin skin(plan.relief_mm, random);
  std::vector<double> highest_N;
  for (size_t p = 0; p < aims.size(); ++p)
    highest_N.push_back(plan.force_N[0] + (plan.force_N[1] - plan.force_N[0]) * (even(random) + 1) / 2);
  const double top_N = *std::min_element(highest_N.begin(), highest_N.end());
  check(tissue, plan, top_N);

  std::vector<HandPress> presses;
  if (truth) truth->clear();
  for (size_t p = 0; p < aims.size(); ++p) {
    const double sd = p == 0 ? plan.first_sd_mm : plan.aim_sd_mm;
    HeldPose pose{{aims[p][0] + sd * normal(random), aims[p][1] + sd * normal(random)},
                  plan.turn_deg * kDegree * even(random) / (p == 0 ? 3 : 1),
                  {}};
    do pose.tilt_rad = {plan.tilt_deg * kDegree * even(random), plan.tilt_deg * kDegree * even(random)};
    while (std::hypot(pose.tilt_rad[0], pose.tilt_rad[1]) > plan.tilt_deg * kDegree);
    const double rate_Hz = 10 + 2 * even(random), phase = 3.2 * even(random), phase_y = 3.2 * even(random);
    const auto trembling = [&](double force_N) {
      const double angle = 2 * std::numbers::pi * rate_Hz * plan.press_s * force_N / highest_N[p];
      HeldPose at = pose;
      at.at_mm[0] += plan.tremor_mm * std::sin(angle + phase);
      at.at_mm[1] += plan.tremor_mm * std::sin(angle + phase_y);
      return at;
    };
    std::vector<double> forces_N;
    std::vector<PressureMap> maps;
    for (uint32_t k = 1; k <= plan.loads; ++k) {
      const double share = 1 - 0.45 * (plan.loads - k) / std::max(1u, plan.loads - 1);
      forces_N.push_back(std::min(highest_N[p], top_N * share * (1 + 0.02 * even(random))));
      maps.push_back(
          under_window(tissue, trembling(forces_N.back()), forces_N.back(), plan.sensor.window_mm));
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
