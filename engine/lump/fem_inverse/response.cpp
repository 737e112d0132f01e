#include "engine/lump/fem_inverse/response.h"

#include <algorithm>
#include <cmath>

#include "engine/fem/large_strain/extrapolation.h"
#include "engine/fem/large_strain/plate_press.h"

namespace palpate::lump {
namespace {

/// Half the difference over which cells are taken to change in proportion: logarithms, and mm.
constexpr std::array<double, kLumpUnknowns> kHalfDifference = {0.002, 0.002, 0.002, 0.01, 0.01};
/// A lump this near is taken to lie in the block's middle where two grids are compared: what is between them
/// hardly changes over such a way, and a quarter of the block is enough.
constexpr double kNearMiddle_mm = 0.3;
constexpr double kLeastOrder = 1.8;  // for what two grids leave open

struct Pressing {
  std::array<double, 2> block_mm;
  double poisson;
  std::array<uint32_t, 3> cells;
  Case block;
  bool turned = false;  ///< the scene's x is the observation's y

  Pressing(const Observation& observation, const std::optional<Case::Lump>& lump,
           const ResponseOptions& options, const std::array<uint32_t, 3>& cells_of_block)
      : block_mm{observation.block_mm[0], observation.block_mm[1]},
        poisson(options.poisson),
        cells(cells_of_block) {
    block.lump = lump;
    block.thickness_mm = observation.block_mm[2];
    block.young_Pa = observation.young_Pa;
    block.press_mm = {observation.block_mm[2] / 10};
    turned = lump && lump->along_y;
  }
  fem::Scene scene() const { return scene_of(block, block_mm, poisson, cells); }

  /// Cells as they are with one unknown changed, the lump's the same ones.
  std::optional<fem::CellGrid> changed(size_t unknown, double by, const fem::InclusionCells& of_lump,
                                       bool quarter) const {
    Pressing other = *this;
    other.block.lump = lump::changed(*block.lump, unknown, by);
    return fit(other.scene(), of_lump, quarter);
  }
};

/// Means over a square of the pitch around each node.
Eigen::VectorXd read(const fem::PressedSurface& surface, const ComparedNodes& nodes, bool turned) {
  const fem::PressureField field(surface);
  const PressureMap& map = nodes.observation().pressure_Pa.front();
  const double gauss = 0.5 / std::sqrt(3.0), dx = gauss * map.pitch_mm[0], dy = gauss * map.pitch_mm[1];
  Eigen::VectorXd values(static_cast<Eigen::Index>(nodes.count()));
  for (size_t n = 0; n < nodes.count(); ++n) {
    double sum = 0;
    for (int point = 0; point < 4; ++point) {
      const double x = nodes.x_mm(n) + (point & 1 ? dx : -dx), y = nodes.y_mm(n) + (point & 2 ? dy : -dy);
      sum += turned ? field.at(y, x) : field.at(x, y);
    }
    values(static_cast<Eigen::Index>(n)) = sum / 4;
  }
  return values;
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

struct Change {
  fem::CellGrid below, above;
  double span;
};

/// One grid's answers, and with `into` their derivatives.
bool press(const ComparedNodes& nodes, const std::optional<FittedLump>& lump, uint32_t times,
           const ResponseOptions& options, Eigen::VectorXd& values, Prediction* into) {
  const Observation& observation = nodes.observation();
  std::array<uint32_t, 3> cells = options.cells;
  for (uint32_t& side : cells) side *= times;
  const Pressing pressing(observation, lump ? std::optional(lump->lump) : std::nullopt, options, cells);
  fem::LargeStrainOptions solver;
  solver.residual = options.residual;
  solver.step_mm = options.step_mm;
  solver.threads = options.threads;
  const fem::Scene scene = pressing.scene();
  const bool quarter = (into == nullptr || options.centred) && symmetric(scene) &&
                       (!lump || lump->cells.times(times).in_middle(scene.cells));
  solver.quarter = quarter;
  std::optional<fem::CellGrid> grid;
  std::vector<Change> by_unknown;
  if (lump) {
    const fem::InclusionCells own = lump->cells.times(times);
    if (!(grid = fit(scene, own, quarter))) return false;
    for (size_t p = 0; into != nullptr && p < (options.centred ? kPlaceX : kLumpUnknowns); ++p) {
      const double half = kHalfDifference[p];
      std::optional<fem::CellGrid> below = pressing.changed(p, -half, own, quarter),
                                   above = pressing.changed(p, half, own, quarter);
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
    if (!plate.to({std::nullopt, force})) return false;
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
  return true;
}

/// Fractions of grids of so many times the same cells in what cells of no size would give: the polynomial in
/// the square of the cells' size through all of them.
std::vector<double> at_no_size(const std::vector<uint32_t>& times) {
  std::vector<double> fraction;
  for (const uint32_t own : times) {
    double product = 1;
    for (const uint32_t other : times)
      if (other != own) product *= 1 / (1 - std::pow(static_cast<double>(other) / own, 2));
    fraction.push_back(product);
  }
  return fraction;
}

}  // namespace

Case::Lump changed(Case::Lump lump, size_t unknown, double by) {
  switch (unknown) {
    case kLnSize:
      lump.diameter_mm *= std::exp(by);
      break;
    case kLnDepth:
      lump.depth_mm *= std::exp(by);
      break;
    case kLnRatio:
      lump.stiffness_ratio *= std::exp(by);
      break;
    default:
      lump.offset_mm[unknown - kPlaceX] += by;
  }
  return lump;
}

ComparedNodes::ComparedNodes(const Observation& observation, double rim_mm) : observation_(observation) {
  const PressureMap& first = observation.pressure_Pa.front();
  for (size_t n = 0; n < first.values.size(); ++n) {
    nodes_.push_back(n);
    const size_t last = nodes_.size() - 1;
    const bool inside = std::abs(x_mm(last)) <= observation.block_mm[0] / 2 - rim_mm &&
                        std::abs(y_mm(last)) <= observation.block_mm[1] / 2 - rim_mm;
    const bool seen = std::all_of(observation.pressure_Pa.begin(), observation.pressure_Pa.end(),
                                  [n](const PressureMap& map) { return std::isfinite(map.values[n]); });
    if (!inside || !seen) nodes_.pop_back();
  }
}

double ComparedNodes::x_mm(size_t node) const {
  const PressureMap& map = observation_.pressure_Pa.front();
  return observation_.window_mm[0] +
         (static_cast<double>(nodes_[node] % map.width) - (map.width - 1) / 2.0) * map.pitch_mm[0];
}

double ComparedNodes::y_mm(size_t node) const {
  const PressureMap& map = observation_.pressure_Pa.front();
  const size_t row = nodes_[node] / map.width;
  return observation_.window_mm[1] + (static_cast<double>(row) - (map.height - 1) / 2.0) * map.pitch_mm[1];
}

Eigen::VectorXd ComparedNodes::values() const {
  Eigen::VectorXd all(static_cast<Eigen::Index>(nodes_.size() * observation_.pressure_Pa.size()));
  Eigen::Index at = 0;
  for (const PressureMap& map : observation_.pressure_Pa)
    for (const size_t n : nodes_) all(at++) = double{map.values[n]};
  return all;
}

fem::InclusionCells response_cells(const Observation& observation, const Case::Lump& lump,
                                   const ResponseOptions& options) {
  return fem::inclusion_cells(Pressing(observation, lump, options, options.cells).scene());
}

bool matches(const fem::InclusionCells& cells, const Observation& observation, const Case::Lump& lump,
             const ResponseOptions& options) {
  return matches(cells, Pressing(observation, lump, options, options.cells).scene());
}

Prediction predict(const ComparedNodes& nodes, const std::optional<FittedLump>& lump,
                   const ResponseOptions& options, bool derivatives) {
  Prediction prediction;
  prediction.converged = press(nodes, lump, options.searched, options, prediction.pressure_Pa,
                               derivatives ? &prediction : nullptr);
  return prediction;
}

GridCorrection grid_correction(const ComparedNodes& nodes, const std::optional<FittedLump>& lump,
                               const ResponseOptions& options) {
  GridCorrection correction;
  std::optional<FittedLump> what = lump;
  if (what &&
      what->cells.in_middle(
          Pressing(nodes.observation(), what->lump, options, options.cells).scene().cells) &&
      std::hypot(what->lump.offset_mm[0], what->lump.offset_mm[1]) < kNearMiddle_mm)
    what->lump.offset_mm = {0, 0};
  const std::vector<uint32_t>& grids = options.grids;
  const std::vector<double> fraction = at_no_size(grids);
  std::vector<double> open = fraction;
  if (grids.size() > 2) {
    const std::vector<double> finer = at_no_size({grids.begin() + 1, grids.end()});
    for (size_t g = 0; g < finer.size(); ++g) open[g + 1] -= finer[g];
  } else if (grids.size() == 2) {
    open[1] -= 1 + fem::extrapolation_fraction(grids[1], grids[0], kLeastOrder);
    open[0] = -open[1];
  } else {
    open[0] = 0;
  }
  const size_t values = nodes.count() * nodes.observation().force_N.size();
  correction.add_Pa = correction.open_Pa = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(values));
  for (size_t g = 0; g < grids.size() && grids.size() > 1; ++g) {
    Eigen::VectorXd pressure_Pa;
    if (!press(nodes, what, grids[g], options, pressure_Pa, nullptr)) return correction;
    correction.add_Pa += (fraction[g] - (grids[g] == options.searched ? 1 : 0)) * pressure_Pa;
    correction.open_Pa += open[g] * pressure_Pa;
  }
  correction.converged = true;
  return correction;
}

}  // namespace palpate::lump
