#include "engine/fem/large_strain/large_strain.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "engine/base/text.h"
#include "engine/fem/large_strain/plate_press.h"
#include "engine/fem/large_strain/rim_error.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

constexpr double kRestDoubt = 0.5;        // of what extrapolation adds beside the rim's part
constexpr double kUnmeasuredDoubt = 0.6;  // of what it adds where the rim is not measured
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

/// From two grids to cells of no size.
class Extrapolation {
 public:
  /// Keeps `rim`, which outlives it; none: not measured. Cells along x.
  Extrapolation(uint32_t cells, uint32_t coarser, double order, const RimError* rim)
      : cells_(cells), coarser_(coarser), on_(extrapolation_fraction(cells, coarser, order)), rim_(rim) {}

  /// In: both grids' answers at a load; out: in the finer's place, what cells of no size would give.
  void apply(size_t load, const PressLoad& asked, const PressedBlock& rough, PressedBlock& block) const {
    // Of a press that was asked for the force is off, of a force the press.
    double& value = asked.press_mm ? block.force_N : block.press_mm;
    const double rough_value = asked.press_mm ? rough.force_N : rough.press_mm;
    double per_N = 1;  // of the value, for each N by which the rim's force is too high at a press
    if (!asked.press_mm && rim_) {
      const double lump = block.force_N / rim_->at(load).force_N;
      per_N = -1 / (rim_->at(load).slope_N_per_mm * lump);
    }
    extrapolate_map(load, !asked.press_mm, rough.pressure_Pa, block);
    double& error = asked.press_mm ? block.force_error_N : block.press_error_mm;
    (asked.press_mm ? block.press_error_mm : block.force_error_N) = 0;
    if (!rim_) {
      const double added = extrapolation_fraction(cells_, coarser_, kForceOrder) * (value - rough_value);
      value += added;
      error = std::abs(added) * kUnmeasuredDoubt;
      return;
    }
    const double fine_rim = per_N * rim_->force_N(load, cells_),
                 rough_rim = per_N * rim_->force_N(load, coarser_);
    const double rest = on_ * ((value - fine_rim) - (rough_value - rough_rim));
    value += rest - fine_rim;
    error = RimError::kDoubt * std::abs(fine_rim) + kRestDoubt * std::abs(rest);
  }

 private:
  void extrapolate_map(size_t load, bool at_force, const Map& rough, PressedBlock& block) const {
    const bool rim = rim_ != nullptr && rim_->at(load).scale_N != 0;
    const double fine_N = rim ? rim_->force_N(load, cells_) : 0,
                 rough_N = rim ? rim_->force_N(load, coarser_) : 0;
    double squares = 0;
    for (size_t n = 0; n < block.pressure_Pa.values.size(); ++n) {
      float& value = block.pressure_Pa.values[n];
      double per_N = 0;
      if (rim) per_N = rim_->at(load).pressure_per_N - (at_force ? rim_->at(load).even_per_N[n] : 0);
      const double own = double{value} - fine_N * per_N;
      const double rest = on_ * (own - (double{rough.values[n]} - rough_N * per_N));
      value = static_cast<float>(own + rest);
      const double error = RimError::kDoubt * std::abs(fine_N * per_N) + kRestDoubt * std::abs(rest);
      squares += error * error;
    }
    block.pressure_error_Pa = std::sqrt(squares / static_cast<double>(block.pressure_Pa.values.size()));
  }

  uint32_t cells_, coarser_;
  double on_;
  const RimError* rim_;
};

void add_costs(const LargeStrainResult& coarse, LargeStrainResult& fine) {
  fine.last_press_mm = std::min(fine.last_press_mm, coarse.last_press_mm);
  fine.last_force_N = std::min(fine.last_force_N, coarse.last_force_N);
  fine.steps += coarse.steps;
  fine.cuts += coarse.cuts;
  fine.newton_rounds += coarse.newton_rounds;
  fine.iterations += coarse.iterations;
  fine.bytes = std::max(fine.bytes, coarse.bytes);
  for (const std::string& line : coarse.warnings)
    if (std::find(fine.warnings.begin(), fine.warnings.end(), line) == fine.warnings.end())
      fine.warnings.push_back(line);
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
  const auto start = std::chrono::steady_clock::now();
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
  fine.converged = fine.converged && coarse.converged;
  fine.loads.resize(std::min(fine.loads.size(), coarse.loads.size()));
  std::vector<double> ways_mm;
  for (const PressedBlock& block : fine.loads) ways_mm.push_back(block.press_mm);
  const std::optional<RimError> rim = RimError::measure(scene, ways_mm, own);
  if (options.stop && options.stop()) fine.converged = false;
  const Extrapolation to_no_size{scene.cells[0], coarser[0], shared ? kFittedOrder : kPressureOrder,
                                 rim ? &*rim : nullptr};
  for (size_t l = 0; l < fine.loads.size(); ++l) {
    to_no_size.apply(l, loads[l], coarse.loads[l], fine.loads[l]);
    if (rim) fine.rim_order.push_back(rim->at(l).order);
  }
  add_costs(coarse, fine);
  fine.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return fine;
}

LargeStrainResult solve_extrapolated(const Scene& scene, const std::vector<PressLoad>& loads,
                                     const LargeStrainOptions& options) {
  return solve_extrapolated(scene, {scene.cells[0] / 2, scene.cells[1] / 2, scene.cells[2] / 2}, loads,
                            options);
}

}  // namespace palpate::fem
