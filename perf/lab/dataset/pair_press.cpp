#include "perf/lab/dataset/pair_press.h"

#include <algorithm>

#include "engine/fem/large_strain/extrapolation.h"

namespace palpate::lump {
namespace {

/// Adds `sign` times another press of the same block at the same ways.
void add(const fem::LargeStrainResult& other, double sign, fem::LargeStrainResult& sum) {
  sum.converged = sum.converged && other.converged;
  sum.loads.resize(std::min(sum.loads.size(), other.loads.size()));
  for (size_t l = 0; l < sum.loads.size(); ++l) {
    fem::PressedBlock& to = sum.loads[l];
    const fem::PressedBlock& from = other.loads[l];
    to.force_N += sign * from.force_N;
    for (size_t n = 0; n < to.pressure_Pa.values.size(); ++n)
      to.pressure_Pa.values[n] += static_cast<float>(sign) * from.pressure_Pa.values[n];
    to.least_volume_ratio = std::min(to.least_volume_ratio, from.least_volume_ratio);
    to.residual = std::max(to.residual, from.residual);
  }
  sum.last_press_mm = std::min(sum.last_press_mm, other.last_press_mm);
  sum.steps += other.steps;
  sum.cuts += other.cuts;
  sum.newton_rounds += other.newton_rounds;
  sum.iterations += other.iterations;
}

}  // namespace

fem::LargeStrainResult press_pair(const fem::Scene& scene, const std::array<uint32_t, 3>& coarser_cells,
                                  const std::vector<fem::PressLoad>& loads,
                                  const fem::LargeStrainOptions& options) {
  fem::Scene one = scene, two = scene, none = scene;
  one.others.clear();
  two.others.clear();
  two.inclusion = scene.others.at(0);
  none.others.clear();
  none.inclusion.reset();
  const auto best = [&](const fem::Scene& of) {
    return solve_extrapolated(of, coarser_cells, loads, options);
  };
  const auto straight = [&](const fem::Scene& of) { return solve_large_strain(of, loads, options); };
  fem::LargeStrainResult sum = best(one);
  add(best(two), 1, sum);
  add(best(none), -1, sum);
  add(straight(scene), 1, sum);
  add(straight(one), -1, sum);
  add(straight(two), -1, sum);
  add(straight(none), 1, sum);
  sum.last_force_N = sum.loads.empty() ? 0 : sum.loads.back().force_N;
  return sum;
}

}  // namespace palpate::lump
