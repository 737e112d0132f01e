// A pressed ball on a coarse grid, for tests of what is judged by pressed blocks.
#pragma once

#include <optional>

#include "engine/fem/large_strain/extrapolation.h"
#include "perf/lab/training/training.h"

namespace palpate {

/// 9 mm, 4 mm deep, five times as stiff, 5 and 3 mm off the middle, at two loads.
inline lump::Example ball_aside() {
  fem::Scene scene;
  scene.cells = {32, 32, 16};
  scene.inclusion->size_mm = {9, 9, 9};
  scene.inclusion->depth_mm = 4;
  scene.inclusion->stiffness_ratio = 5;
  scene.inclusion->offset_mm = {5, 3};
  fem::LargeStrainOptions options;
  options.map_nodes = {33, 33};
  options.step_mm = 2;
  lump::Example e;
  e.size_mm = 9;
  e.depth_mm = 4;
  e.stiffness_ratio = 5;
  e.offset_mm = {5, 3};
  for (const fem::PressedBlock& block :
       solve_extrapolated(scene, {16, 16, 8}, {{1.6, std::nullopt}, {3.2, std::nullopt}}, options).loads) {
    e.pressure_Pa.push_back(block.pressure_Pa);
    e.force_N.push_back(block.force_N);
  }
  return e;
}

}  // namespace palpate
