#include "engine/lump/fem_inverse/grid_series.h"

#include "engine/base/work_team.h"
#include "engine/lump/fem_inverse/pressing.h"
#include "engine/numeric/through_origin.h"

namespace palpate::lump {
namespace {

/// The maps of a press as they are at the observation's forces.
Eigen::VectorXd read_at_forces(const fem::GridPress& press, const ComparedNodes& nodes, bool turned) {
  const std::vector<double>& force_N = nodes.observation().force_N;
  const auto count = static_cast<Eigen::Index>(nodes.count());
  Eigen::MatrixXd reached(count, static_cast<Eigen::Index>(force_N.size()));
  for (Eigen::Index l = 0; l < reached.cols(); ++l)
    reached.col(l) = read(press.surfaces[static_cast<size_t>(l)], nodes, turned);
  Eigen::VectorXd values(count * reached.cols());
  for (Eigen::Index l = 0; l < reached.cols(); ++l) {
    const std::vector<double> factors =
        weights_through_origin(press.force_N, force_N[static_cast<size_t>(l)]);
    values.segment(l * count, count) =
        reached * Eigen::Map<const Eigen::VectorXd>(factors.data(), reached.cols());
  }
  return values;
}

}  // namespace

std::optional<GridSeries::Pressed> GridSeries::press(const std::optional<FittedLump>& lump, uint32_t times,
                                                     const fem::GridPress* coarser) {
  const Observation& observation = nodes_.observation();
  const Pressing pressing(observation, lump ? std::optional(lump->lump) : std::nullopt, options_, times);
  const fem::Scene scene = pressing.scene();
  fem::LargeStrainOptions solver = solver_options(options_);
  solver.quarter = symmetric(scene) && (!lump || lump->cells.times(times).in_middle(scene.cells));
  std::optional<fem::CellGrid> grid;
  if (lump && !(grid = fit(scene, lump->cells.times(times), solver.quarter))) return std::nullopt;
  const auto last = last_.find(times);
  const fem::GridPress* near = coarser;
  if (lump && last != last_.end() && last->second.cells == lump->cells &&
      last->second.lump.shape == lump->lump.shape && last->second.lump.along_y == lump->lump.along_y)
    near = &last->second.press;
  WorkTeam team(options_.threads);
  fem::LargeStrainResult reported;
  std::optional<fem::GridPress> press;
  for (bool another = true; another && !press; near = nullptr) {
    another = near != nullptr;
    fem::LargeStrainModel model(scene, solver, team, grid);
    press = press_to_forces(scene, model, solver, observation.force_N, near, reported);
  }
  if (!press) return std::nullopt;
  Eigen::VectorXd values = read_at_forces(*press, nodes_, pressing.turned);
  if (lump) last_[times] = {lump->lump, lump->cells, *press};
  return Pressed{std::move(values), std::move(*press)};
}

std::optional<GridAnswer> GridSeries::all(const std::optional<FittedLump>& lump) {
  const std::optional<FittedLump> compared = for_comparison(nodes_, lump, options_);
  const std::vector<uint32_t>& grids = options_.grids;
  const std::vector<double> fraction = at_no_size(grids), open = open_fractions(grids);
  GridAnswer answer;
  if (compared) answer.lump = compared->lump;
  GridCorrection& correction = answer.correction;
  std::optional<Pressed> coarser;
  for (size_t g = 0; g < grids.size(); ++g) {
    std::optional<Pressed> pressed = press(compared, grids[g], coarser ? &coarser->press : nullptr);
    if (!pressed) return std::nullopt;
    const Eigen::VectorXd& values = pressed->values;
    if (g == 0) correction.add_Pa = correction.open_Pa = Eigen::VectorXd::Zero(values.size());
    correction.add_Pa += fraction[g] * values;
    correction.open_Pa += open[g] * values;
    if (grids[g] == options_.searched) answer.searched_Pa = values;
    coarser = std::move(pressed);
  }
  correction.add_Pa -= answer.searched_Pa;
  return answer;
}

std::optional<GridAnswer> GridSeries::searched(const FittedLump& lump, const GridCorrection& correction) {
  const std::optional<FittedLump> compared = for_comparison(nodes_, lump, options_);
  const std::optional<Pressed> pressed = press(compared, options_.searched, nullptr);
  if (!pressed) return std::nullopt;
  return GridAnswer{compared->lump, pressed->values, correction};
}

}  // namespace palpate::lump
