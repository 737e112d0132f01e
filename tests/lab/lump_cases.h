// Cheap presses of lumps, for tests of their evaluation.
#pragma once

#include <cmath>

#include "perf/lab/dataset/sample.h"

namespace palpate {

inline lump::Sweep small_sweep(uint64_t seed = 3) {
  lump::Sweep sweep;
  sweep.seed = seed;
  sweep.cells = {16, 16, 8};
  sweep.coarser_cells = {8, 8, 4};
  sweep.nodes = {9, 11};
  sweep.loads = 3;
  return sweep;
}

/// A bump over the lump that grows with the load. Presses of a stiff lump end before the last load.
inline fem::LargeStrainResult quick_press(const fem::Scene& scene,
                                          const std::array<uint32_t, 3>& coarser_cells,
                                          const std::vector<fem::PressLoad>& loads,
                                          const fem::LargeStrainOptions& options) {
  fem::LargeStrainResult result;
  result.converged = coarser_cells[0] != 0;
  for (const fem::PressLoad& load : loads) {
    if (scene.inclusion && scene.inclusion->stiffness_ratio > 25 && result.loads.size() == 2) {
      result.converged = false;
      break;
    }
    fem::PressedBlock block;
    block.press_mm = *load.press_mm;
    block.residual = 1e-7;
    block.least_volume_ratio = 1 - 0.001 * block.press_mm;
    PressureMap& map = block.pressure_Pa;
    map.width = options.map_nodes[0];
    map.height = options.map_nodes[1];
    for (size_t c = 0; c < 2; ++c) map.pitch_mm[c] = scene.block_mm[c] / (options.map_nodes[c] - 1);
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x) {
        double bump = 0;
        if (scene.inclusion) {
          const fem::Inclusion& lump = *scene.inclusion;
          const std::array<double, 3> size = lump.size();
          const double dx = (x * map.pitch_mm[0] - scene.block_mm[0] / 2 - lump.offset_mm[0]) / size[0];
          const double dy = (y * map.pitch_mm[1] - scene.block_mm[1] / 2 - lump.offset_mm[1]) / size[1];
          bump = std::exp(-2 * (dx * dx + dy * dy)) * std::log(lump.stiffness_ratio) / (1 + lump.depth_mm);
        }
        map.values.push_back(
            static_cast<float>(scene.young_Pa * block.press_mm / scene.block_mm[2] * (1 + bump)));
      }
    block.force_N = 1e-6 * scene.block_mm[0] * scene.block_mm[1] * double{map.values[0]};
    result.last_press_mm = block.press_mm;
    result.last_force_N = block.force_N;
    result.loads.push_back(block);
  }
  result.steps = 8;
  result.newton_rounds = 24;
  result.iterations = 300;
  return result;
}

inline lump::Sample quick_sample(const lump::Sweep& sweep, uint32_t number) {
  return *press_case(sweep, number, quick_press);
}

}  // namespace palpate
