// A quick stand-in for the press at large strain, for tests of the evaluation of presses.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "engine/fem/large_strain/large_strain.h"
#include "engine/fem/solve.h"

namespace palpate {

/// Small strain, scaled to each force: the same orderings in a hundredth of the time.
inline fem::LargeStrainResult press_slightly(const fem::Scene& scene,
                                             const std::vector<fem::PressLoad>& loads) {
  fem::Scene slight = scene;
  slight.press_mm.reset();
  slight.force_N = 1;
  const fem::Result one = fem::solve(slight);
  fem::LargeStrainResult result;
  result.converged = one.converged;
  for (const fem::PressLoad& load : loads) {
    fem::PressedBlock block;
    block.force_N = *load.force_N;
    block.press_mm = *load.force_N * one.press_mm;
    block.pressure_Pa = one.stress_Pa;
    for (float& value : block.pressure_Pa.values) value *= static_cast<float>(*load.force_N);
    result.last_force_N = block.force_N;
    result.loads.push_back(std::move(block));
  }
  return result;
}

}  // namespace palpate
