// A block of 4000 Pa, 40 x 40 x 20 mm, pressed by the finite elements and seen by a sensor without noise.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "engine/fem/large_strain/extrapolation.h"
#include "engine/lump/error_sources.h"
#include "engine/lump/network/network.h"
#include "engine/lump/observation/map_at_load.h"
#include "engine/lump/observation/sensor_model.h"
#include "engine/lump/press_effect/press_effect.h"

namespace palpate {

inline const lump::Case::Lump kPressedBall{InclusionShape::Sphere, false, 9, 4, 6, {0, 0}};

/// On the cells of the data sets that taught the network; its ways are stated.
inline lump::Observation pressed_block(const lump::PressConditions& conditions,
                                       const std::optional<lump::Case::Lump>& lump) {
  lump::Case block;
  block.lump = lump;
  block.skin = conditions.skin;
  block.plate_sticks = conditions.plate_sticks;
  block.plate_friction = conditions.plate_friction;
  block.thickness_mm = 20;
  block.young_Pa = 4000;
  block.press_mm = {2.8};
  fem::LargeStrainOptions options;
  options.map_nodes = {33, 33};
  options.step_mm = 2;
  options.residual = 1e-5;
  const std::vector<fem::PressLoad> loads = {
      {0.7, std::nullopt}, {1.4, std::nullopt}, {2.1, std::nullopt}, {2.8, std::nullopt}};
  const fem::LargeStrainResult result =
      solve_extrapolated(scene_of(block, {40, 40}, 0.495, {48, 48, 24}), {24, 24, 12}, loads, options);
  EXPECT_TRUE(result.converged);
  std::vector<PressureMap> maps;
  std::vector<double> force_N, press_mm;
  for (const fem::PressedBlock& load : result.loads) {
    maps.push_back(load.pressure_Pa);
    force_N.push_back(load.force_N);
    press_mm.push_back(load.press_mm);
  }
  lump::Observation o = lump::ideal_observation(maps, force_N, {40, 40, 20}, 4000, 1.25);
  o.noise_Pa = 2;
  o.press_mm = press_mm;
  return o;
}

inline lump::Estimator plain_estimator(const lump::ErrorSources& sources = lump::ErrorSources::none()) {
  return {[](const lump::Observation& o) { return lump::Network::built_in().estimate(o); }, sources};
}

/// What a polynomial through all loads of an observation has at a force.
inline double at_force(const lump::Observation& o, const std::vector<double>& values, double force_N) {
  double sum = 0;
  for (size_t k = 0; k < values.size(); ++k) {
    double weight = force_N / o.force_N[k];
    for (size_t l = 0; l < values.size(); ++l)
      if (l != k) weight *= (force_N - o.force_N[l]) / (o.force_N[k] - o.force_N[l]);
    sum += weight * values[k];
  }
  return sum;
}

/// How far maps at one of an observation's loads are from those of another at the same force, RMS over their
/// middle and the other's peak.
inline double map_difference(const lump::Observation& o, size_t load, const lump::Observation& other) {
  const PressureMap wanted = map_at_load(other, o.force_N[load]);
  double squares = 0, peak = 0, count = 0;
  for (size_t n = 0; n < wanted.values.size(); ++n) {
    if (std::max(n % wanted.width, n / wanted.width) > 28 || std::min(n % wanted.width, n / wanted.width) < 4)
      continue;  // at the rim cells differ most
    squares += std::pow(double{o.pressure_Pa[load].values[n]} - double{wanted.values[n]}, 2);
    peak = std::max(peak, double{wanted.values[n]});
    ++count;
  }
  return std::sqrt(squares / count) / peak;
}

}  // namespace palpate
