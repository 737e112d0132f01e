#include "engine/fem/large_strain/grid_press.h"

#include <algorithm>
#include <cmath>

#include "engine/fem/large_strain/plate_press.h"

namespace palpate::fem {
namespace {

constexpr int kMostTries = 4;              // of a load's force
constexpr double kUsualSlope = 1.1;        // of the force's logarithm with the way's
constexpr double kLeast = 0.8, kMost = 3;  // of that slope

void keep(const LargeStrainModel& model, GridPress& press) {
  press.states.push_back(model.state());
  press.surfaces.push_back(model.surface());
  press.force_N.push_back(model.force_N());
}

/// Change of the force's logarithm with the way's, by two loads of another press.
double slope_at(const GridPress& near, size_t load) {
  if (near.states.size() < 2) return kUsualSlope;
  const size_t last = std::max<size_t>(load, 1), before = last - 1;
  return std::clamp(std::log(near.force_N[last] / near.force_N[before]) /
                        std::log(near.states[last].press_mm / near.states[before].press_mm),
                    kLeast, kMost);
}

bool from_rest(const Scene& scene, LargeStrainModel& model, const LargeStrainOptions& options,
               const std::vector<double>& force_N, LargeStrainResult& result, GridPress& press) {
  PlatePress plate(scene, model, options, result);
  for (const double force : force_N) {
    if (!plate.to({std::nullopt, force})) return false;
    keep(model, press);
  }
  return true;
}

bool from_near(LargeStrainModel& model, const std::vector<double>& force_N, const GridPress& near,
               LargeStrainResult& result, GridPress& press) {
  const double tolerance = force_tolerance(force_N.size());
  const std::array<uint32_t, 3>& cells = model.grid().cells;
  PressedState last;
  for (size_t l = 0; l < force_N.size(); ++l) {
    const PressedState there = on_cells(near.states[l], near.cells, cells);
    PressedState guess = there;
    if (l > 0) {
      // The last load's difference grows with the way.
      const double grown = there.press_mm / last.press_mm;
      guess.add(grown, press.states.back());
      guess.add(-grown, last);
    }
    double to_mm = guess.press_mm * std::pow(force_N[l] / near.force_N[l], 1 / slope_at(near, l));
    for (int tried = 0;; ++tried) {
      if (tried == kMostTries || !model.move_near(std::move(guess), to_mm, result)) return false;
      ++result.steps;
      const double lack = force_N[l] / model.force_N();
      if (std::abs(lack - 1) <= tolerance) break;
      guess = model.state();
      to_mm *= std::pow(lack, 1 / slope_at(near, l));
    }
    keep(model, press);
    last = there;
  }
  return true;
}

}  // namespace

bool GridPress::serves(const LargeStrainModel& model) const {
  return !states.empty() && quarter == model.quarter();
}

double force_tolerance(size_t loads) {
  return loads > 2 ? 0.01 : loads == 2 ? 3e-3 : 2e-4;
}

std::optional<GridPress> press_to_forces(const Scene& scene, LargeStrainModel& model,
                                         const LargeStrainOptions& options,
                                         const std::vector<double>& force_N, const GridPress* near,
                                         LargeStrainResult& result) {
  GridPress press{model.grid().cells, model.quarter(), {}, {}, {}};
  if (near != nullptr && near->serves(model) && near->states.size() == force_N.size()) {
    if (from_near(model, force_N, *near, result, press)) return press;
    return std::nullopt;
  }
  if (from_rest(scene, model, options, force_N, result, press)) return press;
  return std::nullopt;
}

}  // namespace palpate::fem
