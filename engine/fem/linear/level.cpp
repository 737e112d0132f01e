#include "engine/fem/linear/level.h"

#include <algorithm>
#include <utility>

namespace palpate::fem {
namespace {

double highest_eigenvalue(const Stiffness& stiffness) {
  const CellGrid& grid = stiffness.grid();
  double highest = 0;
  for (uint32_t k = 0; k < grid.cells[2]; ++k)
    if (grid.slit != k && (k == 0 || grid.size_z_mm[k] != grid.size_z_mm[k - 1]))
      highest = std::max(highest, element_bound(stiffness.cell_size_mm(k), stiffness.poisson()));
  if (grid.slit)
    for (const uint32_t k : {*grid.slit - 1, *grid.slit + 1})
      highest = std::max(highest, element_bound(stiffness.cell_size_mm(k), stiffness.poisson(), true));
  return highest;
}

}  // namespace

std::vector<ChebyshevStep> chebyshev_steps(double highest, const Smoothing& smoothing) {
  const double center = highest * (1 + 1 / smoothing.spread) / 2,
               half = highest * (1 - 1 / smoothing.spread) / 2;
  std::vector<ChebyshevStep> steps = {{0, 1 / center}};
  double rho = half / center;
  while (steps.size() < smoothing.steps) {
    const double next = 1 / (2 * center / half - rho);
    steps.push_back({next * rho, 2 * next / half});
    rho = next;
  }
  return steps;
}

GridLevel::GridLevel(const CellGrid& g, double poisson, const FixedNodes& f, const Smoothing& smoothing)
    : grid(g),
      fixed(f),
      stiffness(grid, poisson),
      steps(chebyshev_steps(highest_eigenvalue(stiffness), smoothing)) {}

GridLevel::GridLevel(CellGrid&& g, double poisson, FixedNodes&& f, const Smoothing& smoothing)
    : own_grid(std::move(g)),
      own_fixed(std::move(f)),
      grid(*own_grid),
      fixed(*own_fixed),
      stiffness(grid, poisson),
      steps(chebyshev_steps(highest_eigenvalue(stiffness), smoothing)) {}

}  // namespace palpate::fem
