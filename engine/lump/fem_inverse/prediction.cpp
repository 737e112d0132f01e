#include "engine/lump/fem_inverse/prediction.h"

#include <algorithm>
#include <cmath>

#include "engine/fem/large_strain/plate_press.h"
#include "engine/lump/fem_inverse/pressing.h"

namespace palpate::lump {
namespace {

/// Half the difference over which cells are taken to change in proportion: logarithms, and mm.
constexpr std::array<double, kLumpUnknowns> kHalfDifference = {0.002, 0.002, 0.002, 0.01, 0.01};

/// Cells as they are with one unknown changed, the lump's the same ones.
std::optional<fem::CellGrid> changed_cells(Pressing pressing, size_t unknown, double by,
                                           const fem::InclusionCells& of_lump, bool quarter) {
  pressing.block.lump = changed(*pressing.block.lump, unknown, by);
  return fit(pressing.scene(), of_lump, quarter);
}

fem::PressedSurface plus(const fem::PressedSurface& a, double factor, const fem::PressedSurface& b) {
  fem::PressedSurface sum = a;
  for (size_t n = 0; n < a.force_N.size(); ++n) {
    sum.force_N[n] += factor * b.force_N[n];
    sum.x_mm[n] += factor * b.x_mm[n];
    sum.y_mm[n] += factor * b.y_mm[n];
  }
  return sum;
}

/// Change of what is read per unit of a change of the surface.
Eigen::VectorXd change_read(const fem::PressedSurface& surface, const fem::PressedSurface& change,
                            const ComparedNodes& nodes, bool turned) {
  double largest = 1e-12;
  for (size_t n = 0; n < change.x_mm.size(); ++n)
    largest = std::max({largest, std::abs(change.x_mm[n]), std::abs(change.y_mm[n])});
  const double step = std::min(1e-2, 1e-3 / largest);
  return (read(plus(surface, step, change), nodes, turned) -
          read(plus(surface, -step, change), nodes, turned)) /
         (2 * step);
}

struct CellsChange {
  fem::CellGrid below, above;
  double span;
};

/// One grid's answers, and with `into` their derivatives.
bool press(const ComparedNodes& nodes, const std::optional<FittedLump>& lump, uint32_t times,
           const ResponseOptions& options, Effort& effort, Eigen::VectorXd& values, Prediction* into) {
  if (effort.spent()) return false;
  const Observation& observation = nodes.observation();
  const Pressing pressing(observation, lump ? std::optional(lump->lump) : std::nullopt, options, times);
  const fem::Scene scene = pressing.scene();
  const bool quarter = (into == nullptr || options.centred) && symmetric(scene) &&
                       (!lump || lump->cells.times(times).in_middle(scene.cells));
  fem::LargeStrainOptions solver = solver_options(options, effort.watch(count_cells(scene, quarter), true));
  solver.quarter = quarter;
  std::optional<fem::CellGrid> grid;
  std::vector<CellsChange> by_unknown;
  if (lump) {
    const fem::InclusionCells own = lump->cells.times(times);
    if (!(grid = fit(scene, own, quarter))) return false;
    for (size_t p = 0; into != nullptr && p < (options.centred ? kPlaceX : kLumpUnknowns); ++p) {
      const double half = kHalfDifference[p];
      std::optional<fem::CellGrid> below = changed_cells(pressing, p, -half, own, quarter),
                                   above = changed_cells(pressing, p, half, own, quarter);
      if (!below || !above) return false;
      by_unknown.push_back({std::move(*below), std::move(*above), 2 * half});
    }
  }
  WorkTeam team(options.threads);
  fem::LargeStrainModel model(scene, solver, team, std::move(grid));
  fem::LargeStrainResult reported;
  fem::PlatePress plate(scene, model, solver, reported);
  const auto count = static_cast<Eigen::Index>(nodes.count());
  const auto loads = static_cast<Eigen::Index>(observation.force_N.size());
  values.resize(count * loads);
  if (into != nullptr) {
    into->by_unknown = Eigen::MatrixXd::Zero(count * loads, kLumpUnknowns);
    into->by_force = Eigen::MatrixXd::Zero(count * loads, loads);
    into->by_modulus = Eigen::VectorXd::Zero(count * loads);
  }
  for (Eigen::Index l = 0; l < loads; ++l) {
    const double force = observation.force_N[static_cast<size_t>(l)];
    if (effort.spent() || !plate.to({std::nullopt, force})) return false;
    const fem::PressedSurface surface = model.surface();
    values.segment(l * count, count) = read(surface, nodes, pressing.turned);
    if (into == nullptr) continue;
    const fem::PressedSurface by_press = model.change_by_press(reported);
    const double slope = by_press.sum_N();
    for (size_t p = 0; p < by_unknown.size(); ++p) {
      const fem::PressedSurface change =
          model.change_by_grids(by_unknown[p].below, by_unknown[p].above, by_unknown[p].span, reported);
      // The plate gives way so that the force stays.
      into->by_unknown.col(static_cast<Eigen::Index>(p)).segment(l * count, count) =
          change_read(surface, plus(change, -change.sum_N() / slope, by_press), nodes, pressing.turned);
    }
    into->by_force.col(l).segment(l * count, count) =
        change_read(surface, by_press, nodes, pressing.turned) * (force / slope);
    into->by_modulus.segment(l * count, count) =
        values.segment(l * count, count) - into->by_force.col(l).segment(l * count, count);
  }
  return !effort.spent();
}

}  // namespace

fem::InclusionCells response_cells(const Observation& observation, const Case::Lump& lump,
                                   const ResponseOptions& options) {
  return fem::inclusion_cells(Pressing(observation, lump, options).scene());
}

bool matches(const fem::InclusionCells& cells, const Observation& observation, const Case::Lump& lump,
             const ResponseOptions& options) {
  return matches(cells, Pressing(observation, lump, options).scene());
}

Prediction predict(const ComparedNodes& nodes, const std::optional<FittedLump>& lump,
                   const ResponseOptions& options, bool derivatives, Effort& effort) {
  Prediction prediction;
  prediction.converged = press(nodes, lump, options.searched, options, effort, prediction.pressure_Pa,
                               derivatives ? &prediction : nullptr);
  return prediction;
}

}  // namespace palpate::lump
