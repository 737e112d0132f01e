#include "engine/lump/fem_inverse/grid_series.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/work_team.h"
#include "engine/lump/fem_inverse/pressing.h"
#include "engine/numeric/through_origin.h"

namespace palpate::lump {
namespace {

/// The maps of a press as they are at these forces.
Eigen::VectorXd read_at_forces(const fem::GridPress& press, const std::vector<double>& force_N,
                               const ComparedNodes& nodes, bool turned) {
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

/// Every second load, the highest among them, where there are three and more.
std::vector<size_t> some_loads(size_t count) {
  std::vector<size_t> loads;
  for (size_t l = 0; l < count; ++l)
    if (count < 3 || (count - 1 - l) % 2 == 0) loads.push_back(l);
  return loads;
}

std::vector<double> at_loads(const std::vector<double>& force_N, const std::vector<size_t>& loads) {
  std::vector<double> some;
  some.reserve(loads.size());
  for (const size_t l : loads) some.push_back(force_N[l]);
  return some;
}

fem::GridPress at_loads(const fem::GridPress& press, const std::vector<size_t>& loads) {
  fem::GridPress some{press.cells, press.quarter, {}, {}, {}};
  for (const size_t l : loads) {
    some.states.push_back(press.states[l]);
    some.surfaces.push_back(press.surfaces[l]);
    some.force_N.push_back(press.force_N[l]);
  }
  return some;
}

/// Values at all loads from those at some: what they differ from a coarser grid's is a polynomial of the
/// force through the origin.
Eigen::VectorXd at_all_loads(const Eigen::VectorXd& some, const std::vector<size_t>& loads,
                             const Eigen::VectorXd& coarser, const std::vector<double>& force_N) {
  if (loads.size() == force_N.size()) return some;
  const auto all = static_cast<Eigen::Index>(force_N.size()), count = coarser.size() / all;
  const std::vector<double> known_N = at_loads(force_N, loads);
  Eigen::VectorXd values = coarser;
  for (Eigen::Index l = 0; l < all; ++l) {
    const std::vector<double> weights = weights_through_origin(known_N, force_N[static_cast<size_t>(l)]);
    for (size_t k = 0; k < loads.size(); ++k)
      values.segment(l * count, count) +=
          weights[k] * (some.segment(static_cast<Eigen::Index>(k) * count, count) -
                        coarser.segment(static_cast<Eigen::Index>(loads[k]) * count, count));
  }
  return values;
}

}  // namespace

std::optional<GridSeries::Pressed> GridSeries::press(const std::optional<FittedLump>& lump, uint32_t times,
                                                     const std::vector<double>& force_N,
                                                     const fem::GridPress* coarser) {
  const Observation& observation = nodes_.observation();
  const Pressing pressing(observation, lump ? std::optional(lump->lump) : std::nullopt, options_, times);
  const fem::Scene scene = pressing.scene();
  const bool quarter = symmetric(scene) && (!lump || lump->cells.times(times).in_middle(scene.cells));
  fem::LargeStrainOptions solver =
      solver_options(options_, effort_.watch(count_cells(scene, quarter), lump.has_value()));
  solver.quarter = quarter;
  std::optional<fem::CellGrid> grid;
  if (lump && !(grid = fit(scene, lump->cells.times(times), solver.quarter))) return std::nullopt;
  const fem::GridPress* near = coarser;
  const LastOf own = lump ? LastOf{times, lump->lump.shape, lump->lump.along_y} : LastOf{};
  if (const auto last = last_.find(own); lump && last != last_.end() && last->second.cells == lump->cells)
    near = &last->second.press;
  WorkTeam team(options_.threads);
  fem::LargeStrainResult reported;
  std::optional<fem::GridPress> press;
  for (bool another = true; another && !press && !(lump && effort_.spent()); near = nullptr) {
    another = near != nullptr;
    fem::LargeStrainModel model(scene, solver, team, grid);
    press = press_to_forces(scene, model, solver, force_N, near, reported);
  }
  if (!press) return std::nullopt;
  Eigen::VectorXd values = read_at_forces(*press, force_N, nodes_, pressing.turned);
  if (lump) last_[own] = {lump->cells, *press};
  return Pressed{std::move(values), std::move(*press)};
}

std::optional<GridAnswer> GridSeries::ask(const std::optional<FittedLump>& lump, AskedGrids grids,
                                          const GridCorrection* known) {
  const std::optional<FittedLump> compared = for_comparison(nodes_, lump, options_);
  GridAnswer answer;
  if (compared) answer.lump = compared->lump;
  const std::vector<double>& force_N = nodes_.observation().force_N;
  std::vector<Eigen::VectorXd> values;
  std::optional<Pressed> coarser;
  for (const uint32_t times : asked(grids)) {
    const bool finer = times > options_.searched;
    const std::vector<size_t> loads = some_loads(finer ? force_N.size() : 0);
    if (finer && coarser && coarser->press.states.size() == force_N.size())
      coarser->press = at_loads(coarser->press, loads);
    std::optional<Pressed> pressed = press(compared, times, finer ? at_loads(force_N, loads) : force_N,
                                           coarser ? &coarser->press : nullptr);
    if (!pressed) return std::nullopt;
    values.push_back(finer ? at_all_loads(pressed->values, loads, values.back(), force_N) : pressed->values);
    if (times == options_.searched) answer.searched_Pa = values.back();
    coarser = std::move(pressed);
  }
  answer.of_all = values.size() == options_.grids.size();
  if (grids == AskedGrids::Searched)
    answer.correction = *known;
  else
    answer.correction = correction_of(values, answer.searched_Pa, known);
  return answer;
}

std::vector<uint32_t> GridSeries::asked(AskedGrids grids) const {
  const std::vector<uint32_t>& all = options_.grids;
  if (grids == AskedGrids::Searched) return {options_.searched};
  const auto last = std::find(all.begin(), all.end(), options_.searched);
  return grids == AskedGrids::Coarse && last != all.begin() ? std::vector(all.begin(), last + 1) : all;
}

GridCorrection GridSeries::correction_of(const std::vector<Eigen::VectorXd>& values,
                                         const Eigen::VectorXd& searched_Pa,
                                         const GridCorrection* known) const {
  const std::vector<uint32_t>& all = options_.grids;
  const auto sum = [&](const std::vector<double>& factors) {
    Eigen::VectorXd total = Eigen::VectorXd::Zero(searched_Pa.size());
    for (size_t g = 0; g < factors.size(); ++g) total += factors[g] * values[g];
    return total;
  };
  const std::vector<uint32_t> own(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(values.size()));
  GridCorrection correction;
  correction.add_Pa = sum(at_no_size(own)) - searched_Pa;
  correction.open_Pa = sum(open_fractions(own));
  if (own == all) {
    correction.finer_Pa = correction.add_Pa - (sum(at_no_size(asked(AskedGrids::Coarse))) - searched_Pa);
  } else if (known != nullptr && known->finer_Pa.size() > 0) {
    correction.finer_Pa = known->finer_Pa;
    correction.add_Pa += known->finer_Pa;
    correction.open_Pa = known->open_Pa;
  }
  return correction;
}

}  // namespace palpate::lump
