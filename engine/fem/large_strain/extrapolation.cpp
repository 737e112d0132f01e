#include "engine/fem/large_strain/extrapolation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <string>

#include "engine/fem/large_strain/large_strain.h"
#include "engine/fem/large_strain/rim_error.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

constexpr double kRestDoubt = 0.5;        // of what extrapolation adds to the rim's part
constexpr double kUnmeasuredDoubt = 0.6;  // of what it adds where the rim is not measured
constexpr uint32_t kLeastCommon = 12;  // cells along x and y of the grid whose cells are chosen; half along z

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
    // Where a press was asked for the force has the error, where a force the press.
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
  if (skin_layers(scene) * coarser[2] != skin_layers(coarse_scene) * scene.cells[2])
    throw Error(Failure::Usage, "grids with one share of their layers in the skin, such as multiples of 6",
                std::to_string(scene.cells[2]) + " and " + std::to_string(coarser[2]) + " layers",
                "48x48x24 cells and half as many");
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
