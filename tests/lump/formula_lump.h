// Blocks whose pressure is a formula: quick to make, with a lump that is known.
#pragma once

#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "engine/fem/scene.h"
#include "engine/lump/observation/sensor_model.h"

namespace palpate {

struct FormulaLump {
  bool lump = true;
  InclusionShape shape = InclusionShape::Sphere;
  bool along_y = false;
  double size_mm = 0, depth_mm = 0, stiffness_ratio = 1;
  std::array<double, 2> offset_mm{};
  std::array<double, 3> block_mm = {40, 40, 20};
  double young_Pa = 4000;
  std::vector<PressureMap> pressure_Pa;
  std::vector<double> force_N;
};

/// Pressure over the tissue's modulus at a load, a formula with the features of the real one: wider and
/// fainter with depth, larger with size, and a stiff lump's share grows with the load.
inline double formula(const FormulaLump& e, double load, double x, double y) {
  const double edge = 1 - 0.1 * std::pow(x / 20, 4) - 0.1 * std::pow(y / 20, 4);
  double p = load * edge * (1 + 0.2 * load + 0.01 * (e.block_mm[2] - 20));
  if (!e.lump) return p;
  const double contrast = (e.stiffness_ratio - 1) / (e.stiffness_ratio + 2);
  const double q = std::pow(e.size_mm / (e.size_mm + e.depth_mm), 2), w = 0.3 * e.size_mm + 0.7 * e.depth_mm;
  double u = x - e.offset_mm[0], v = y - e.offset_mm[1];
  if (e.along_y) std::swap(u, v);
  if (e.shape == InclusionShape::LyingCylinder) u /= 2;
  p += 2 * load * contrast * q * (1 + 2.5 * load * std::log(e.stiffness_ratio)) *
       std::exp(-(u * u + v * v) / (2 * w * w));
  return p;
}

inline FormulaLump formula_lump(uint64_t seed, bool lump) {
  std::mt19937_64 random(seed);
  // The query lies within the training range.
  const double edge = seed < 1000 ? 0 : 0.06;
  std::uniform_real_distribution<double> share(edge, 1 - edge);
  FormulaLump e;
  e.lump = lump;
  e.shape = share(random) < 0.5 ? InclusionShape::Sphere : InclusionShape::LyingCylinder;
  e.along_y = e.shape == InclusionShape::LyingCylinder && share(random) < 0.5;
  e.size_mm = 5 + 7 * share(random);
  e.depth_mm = 2 + 5 * share(random);
  e.stiffness_ratio = 1.5 * std::pow(20, share(random));
  e.offset_mm = {-4 + 8 * share(random), -4 + 8 * share(random)};
  e.block_mm = {40, 40, 18 + 4 * share(random)};
  e.young_Pa = 2000 * std::pow(10, share(random));
  const double most = 0.2 + 0.15 * share(random);
  for (int k = 1; k <= 4; ++k) {
    const double load = most * k / 4;
    PressureMap map;
    map.width = map.height = 33;
    map.pitch_mm = {1.25, 1.25};
    for (int j = 0; j < 33; ++j)
      for (int i = 0; i < 33; ++i)
        map.values.push_back(
            static_cast<float>(e.young_Pa * formula(e, load, (i - 16) * 1.25, (j - 16) * 1.25)));
    e.pressure_Pa.push_back(std::move(map));
    e.force_N.push_back(load * e.young_Pa * 1600e-6);
  }
  return e;
}

inline lump::Observation read(const FormulaLump& e, double noise_fraction, uint64_t seed) {
  lump::PalpationSensor sensor;
  sensor.size_px = {160, 120};
  sensor.noise_fraction = noise_fraction;
  return sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, sensor, seed);
}

}  // namespace palpate
