// A ball's bump, as the built-in network's emulator has it, in an observation of tissue alone.
#pragma once

#include <array>
#include <cmath>

#include "engine/lump/network/model.h"
#include "engine/lump/network/network.h"

namespace palpate {

inline std::array<double, 2> place_of(const PressureMap& map, size_t n) {
  return {(static_cast<double>(n % map.width) - (map.width - 1) / 2.0) * map.pitch_mm[0],
          (static_cast<double>(n / map.width) - (map.height - 1) / 2.0) * map.pitch_mm[1]};
}

inline void add_emulated_ball(double size_mm, double depth_mm, double ratio, std::array<double, 2> offset_mm,
                              lump::Observation& observation) {
  const lump::Model& model = lump::Network::built_in().model();
  lump::Setting setting;
  setting.cell_mm = model.cell_mm;
  setting.thickness_mm = observation.block_mm[2];
  setting.x_mm = std::abs(offset_mm[0]);
  setting.y_mm = std::abs(offset_mm[1]);
  const std::vector<double> loads = loads_of(observation);
  const lump::Guess guess{InclusionShape::Sphere, std::log(size_mm), std::log(depth_mm), std::log(ratio)};
  const Eigen::MatrixXd factors = bump_factors(model, guess, setting, loads, -1);
  Eigen::VectorXf fields(model.patch.count());
  for (size_t k = 0; k < loads.size(); ++k) {
    PressureMap& map = observation.pressure_Pa[k];
    for (size_t n = 0; n < map.values.size(); ++n) {
      const auto [x, y] = place_of(map, n);
      const double u = (offset_mm[0] < 0 ? -1 : 1) * (x - offset_mm[0]),
                   v = (offset_mm[1] < 0 ? -1 : 1) * (y - offset_mm[1]);
      if (std::max(std::abs(u), std::abs(v)) > model.patch.reach_mm()) continue;
      model.patch.at(u, v, fields.data());
      map.values[n] += static_cast<float>(
          observation.young_Pa * fields.cast<double>().dot(factors.col(static_cast<Eigen::Index>(k))));
    }
  }
}

}  // namespace palpate
