#include "engine/fem/large_strain/large_strain.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "engine/base/text.h"
#include "engine/fem/large_strain/plate_press.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

constexpr uint32_t kLeastCommon = 12;  // cells along x and y of the grid whose cells are chosen; half along z

void check_loads(const Scene& scene, const std::vector<PressLoad>& loads) {
  double last_mm = 0, last_N = 0, whole = scene.block_mm[2];
  for (const PadSheet& sheet : scene.pad) whole += sheet.thickness_mm;
  if (loads.empty()) throw Error(Failure::Usage, "a load at least", "none", "a way or a force");
  for (const PressLoad& load : loads) {
    if (load.press_mm.has_value() == load.force_N.has_value())
      throw Error(Failure::Usage, "either a way to press or a force", load.press_mm ? "both" : "neither",
                  "one of the two");
    const double value = load.press_mm ? *load.press_mm : *load.force_N;
    double& last = load.press_mm ? last_mm : last_N;
    if (!(value > last) || !std::isfinite(value))
      throw Error(Failure::Usage, "loads that rise from above zero", std::to_string(value), "them in order");
    if (load.press_mm && value > whole / 2)
      throw Error(Failure::Usage, "a press of half the thickness at most",
                  std::to_string(value) + " mm of " + std::to_string(whole), "a shorter way");
    last = value;
  }
}

/// Cells of both grids that follow the scene's inclusion alike.
struct SharedCells {
  InclusionCells fine, coarse;
};
std::optional<SharedCells> shared_cells(const Scene& scene, const Scene& coarser, bool quarter) {
  const auto common = common_cells(scene.cells, coarser.cells);
  if (!common || !scene.inclusion || !scene.others.empty() || !scene.pad.empty()) return std::nullopt;
  Scene shared = scene;
  shared.cells = *common;
  const InclusionCells cells = inclusion_cells(shared);
  const SharedCells both{cells.times(scene.cells[0] / (*common)[0]),
                         cells.times(coarser.cells[0] / (*common)[0])};
  if (!fit(scene, both.fine, quarter) || !fit(coarser, both.coarse, quarter)) return std::nullopt;
  return both;
}

}  // namespace

LargeStrainResult solve_large_strain(const Scene& scene, const std::vector<PressLoad>& loads,
                                     const LargeStrainOptions& options) {
  check_loads(scene, loads);
  if (!(options.residual >= 1e-10 && options.residual <= 1e-2))
    throw Error(Failure::Usage, "a relative residual from 1e-10 to 1e-2", std::to_string(options.residual),
                "1e-6");
  for (const uint32_t nodes : options.map_nodes)
    if (nodes == 1 || nodes > 4096)
      throw Error(Failure::Usage, "2 to 4096 nodes of a map", std::to_string(nodes), "0 for the cells' own");
  if (!(options.step_mm > 0))
    throw Error(Failure::Usage, "a step above 0 mm", std::to_string(options.step_mm), "0.5");
  const auto start = std::chrono::steady_clock::now();
  WorkTeam team(options.threads);
  LargeStrainResult result;
  std::optional<CellGrid> followed;
  if (options.lump_cells) {
    followed = fit(scene, *options.lump_cells, options.quarter && symmetric(scene));
    if (!followed)
      throw Error(Failure::Usage, "cells that can follow the lump", "some that would be turned inside out",
                  "more cells, or straight ones");
  }
  LargeStrainModel model(scene, options, team, std::move(followed));
  PlatePress press(scene, model, options, result);
  result.converged = true;
  for (const PressLoad& load : loads) {
    if (!press.to(load)) {
      result.converged = false;
      break;
    }
    result.loads.push_back(model.measure());
  }
  result.follows_lump = options.lump_cells.has_value();
  result.last_press_mm = model.press_mm();
  result.last_force_N = model.force_N();
  result.bytes = model.bytes();
  if (!result.converged) {
    const std::string line = text("the press ended at %.3g mm and %.3g N: no equilibrium was found beyond",
                                  result.last_press_mm, result.last_force_N);
    result.warnings.emplace_back(line);
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

double extrapolation_fraction(uint32_t cells, uint32_t coarser, double order) {
  return 1 / (std::pow(static_cast<double>(cells) / coarser, order) - 1);
}

std::optional<std::array<uint32_t, 3>> common_cells(const std::array<uint32_t, 3>& cells,
                                                    const std::array<uint32_t, 3>& coarser) {
  const uint32_t times = cells[0] / std::gcd(cells[0], coarser[0]);
  std::array<uint32_t, 3> common{};
  for (size_t c = 0; c < 3; ++c) {
    common[c] = cells[c] / times;
    if (cells[c] % times != 0 || common[c] < (c < 2 ? kLeastCommon : kLeastCommon / 2)) return std::nullopt;
  }
  return common;
}

LargeStrainResult solve_extrapolated(const Scene& scene, const std::array<uint32_t, 3>& coarser,
                                     const std::vector<PressLoad>& loads, const LargeStrainOptions& options) {
  for (size_t c = 0; c < 3; ++c)
    if (coarser[c] >= scene.cells[c] ||
        uint64_t{coarser[c]} * scene.cells[0] != uint64_t{coarser[0]} * scene.cells[c])
      throw Error(
          Failure::Usage, "fewer cells in the same proportions",
          std::to_string(coarser[0]) + "x" + std::to_string(coarser[1]) + "x" + std::to_string(coarser[2]),
          "three quarters of each side's");
  Scene coarse_scene = scene;
  coarse_scene.cells = coarser;
  LargeStrainOptions own = options;
  for (size_t c = 0; c < 2; ++c)
    if (own.map_nodes[c] == 0) own.map_nodes[c] = scene.cells[c] + 1;
  const std::optional<SharedCells> shared =
      shared_cells(scene, coarse_scene, options.quarter && symmetric(scene));
  if (shared) own.lump_cells = shared->fine;
  LargeStrainResult fine = solve_large_strain(scene, loads, own);
  if (shared) own.lump_cells = shared->coarse;
  const LargeStrainResult coarse = solve_large_strain(coarse_scene, loads, own);
  const auto pressure_on = static_cast<float>(
      extrapolation_fraction(scene.cells[0], coarser[0], shared ? kFittedOrder : kPressureOrder));
  const double force_on = extrapolation_fraction(scene.cells[0], coarser[0], kForceOrder);
  fine.converged = fine.converged && coarse.converged;
  fine.loads.resize(std::min(fine.loads.size(), coarse.loads.size()));
  for (size_t l = 0; l < fine.loads.size(); ++l) {
    PressedBlock& block = fine.loads[l];
    const PressedBlock& rough = coarse.loads[l];
    for (size_t n = 0; n < block.pressure_Pa.values.size(); ++n) {
      float& value = block.pressure_Pa.values[n];
      value += pressure_on * (value - rough.pressure_Pa.values[n]);
    }
    block.force_N += force_on * (block.force_N - rough.force_N);
    block.press_mm += force_on * (block.press_mm - rough.press_mm);
  }
  fine.last_press_mm = std::min(fine.last_press_mm, coarse.last_press_mm);
  fine.last_force_N = std::min(fine.last_force_N, coarse.last_force_N);
  fine.steps += coarse.steps;
  fine.cuts += coarse.cuts;
  fine.newton_rounds += coarse.newton_rounds;
  fine.iterations += coarse.iterations;
  fine.wall_s += coarse.wall_s;
  fine.bytes = std::max(fine.bytes, coarse.bytes);
  for (const std::string& line : coarse.warnings)
    if (std::find(fine.warnings.begin(), fine.warnings.end(), line) == fine.warnings.end())
      fine.warnings.push_back(line);
  return fine;
}

LargeStrainResult solve_extrapolated(const Scene& scene, const std::vector<PressLoad>& loads,
                                     const LargeStrainOptions& options) {
  return solve_extrapolated(scene, {scene.cells[0] / 2, scene.cells[1] / 2, scene.cells[2] / 2}, loads,
                            options);
}

}  // namespace palpate::fem
