#include "engine/palpation/hand/held_pad.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/palpation/scan.h"
#include "engine/tissue/map_sampling.h"

namespace palpate {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

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

}  // namespace

SkinTexture::SkinTexture(double rms, const std::array<double, 2>& length_mm, std::mt19937_64& random) {
  constexpr int kWaves = 48;
  std::uniform_real_distribution<double> any(0, 1);
  for (int k = 0; k < kWaves; ++k) {
    const double way = 2 * std::numbers::pi * any(random);
    const double length = length_mm[0] * std::pow(length_mm[1] / length_mm[0], any(random));
    const double number = 2 * std::numbers::pi / length;
    waves_.push_back({number * std::cos(way), number * std::sin(way), 2 * std::numbers::pi * any(random),
                      rms * std::sqrt(2.0 / kWaves)});
  }
}

double SkinTexture::at(double x_mm, double y_mm) const {
  double sum = 0;
  for (const Wave& w : waves_) sum += w.height * std::sin(w.x * x_mm + w.y * y_mm + w.phase);
  return sum;
}

std::array<double, 2> HeldPose::block(double u_mm, double v_mm) const {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return {at_mm[0] + c * u_mm - s * v_mm, at_mm[1] + s * u_mm + c * v_mm};
}

HeldPose HeldPress::at(double time_s) const {
  HeldPose now = pose;
  const double angle = 2 * std::numbers::pi * rate_Hz * time_s;
  for (size_t c = 0; c < 2; ++c) now.at_mm[c] += tremor_mm * std::sin(angle + phase_rad[c]);
  return now;
}

HeldPress held_press(const HandSkill& skill, const std::array<double, 2>& aim_mm, double miss_sd_mm,
                     std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even(-1, 1);
  HeldPress press;
  for (size_t c = 0; c < 2; ++c) press.pose.at_mm[c] = aim_mm[c] + miss_sd_mm * normal(random);
  press.pose.turn_rad = skill.turn_deg * kDegree * even(random);
  auto& tilt = press.pose.tilt_rad;
  do tilt = {skill.tilt_deg * kDegree * even(random), skill.tilt_deg * kDegree * even(random)};
  while (std::hypot(tilt[0], tilt[1]) > skill.tilt_deg * kDegree);
  press.tremor_mm = skill.tremor_mm;
  press.rate_Hz = 10 + 2 * even(random);
  press.phase_rad = {std::numbers::pi * even(random), std::numbers::pi * even(random)};
  return press;
}

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

double hand_load(double top_N, uint32_t load, uint32_t loads) {
  return top_N * (1 - 0.45 * (loads - load) / std::max(1u, loads - 1));
}

PressureMap pressure_under(const PressedTissue& tissue, const HeldPose& pose, double force_N,
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

std::array<double, 2> skin_place(const PressedTissue& tissue, const HeldPose& pose, double force_N, double x,
                                 double y) {
  const double height = tissue.block_mm[2], depth = between(tissue.force_N, tissue.press_mm, force_N);
  const double shrink = std::sqrt(1 - depth / height);
  const double a = pose.tilt_rad[0] / (4 * height), b = pose.tilt_rad[1] / (4 * height);
  return {shrink * (x - a * (x * x - y * y) - 2 * b * x * y),
          shrink * (y - b * (y * y - x * x) - 2 * a * x * y)};
}

}  // namespace palpate
