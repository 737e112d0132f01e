#include "engine/fem/large_strain/large_strain.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "engine/base/text.h"
#include "engine/fem/large_strain/plate_press.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

void check_loads(const Scene& scene, const std::vector<PressLoad>& loads) {
  double last_mm = 0, last_N = 0, whole = scene.block_mm[2];
  for (const PadSheet& sheet : scene.pad) whole += sheet.thickness_mm;
  if (loads.empty()) throw Error(Failure::Usage, "at least one load", "none", "a travel or a force");
  for (const PressLoad& load : loads) {
    if (load.press_mm.has_value() == load.force_N.has_value())
      throw Error(Failure::Usage, "either a travel or a force of the presser",
                  load.press_mm ? "both" : "neither", "one of the two");
    const double value = load.press_mm ? *load.press_mm : *load.force_N;
    double& last = load.press_mm ? last_mm : last_N;
    if (!(value > last) || !std::isfinite(value))
      throw Error(Failure::Usage, "loads above zero in rising order", std::to_string(value),
                  "the loads in order");
    if (load.press_mm && value > whole / 2)
      throw Error(Failure::Usage, "a press of half the thickness at most",
                  std::to_string(value) + " mm of " + std::to_string(whole), "a shorter travel");
    last = value;
  }
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
      throw Error(Failure::Usage, "cells that can follow the lump", "cells that would be turned inside out",
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

}  // namespace palpate::fem
