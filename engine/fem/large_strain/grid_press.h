// A block pressed to given forces, starting from what another grid or another lump answered to them.
#pragma once

#include <optional>
#include <vector>

#include "engine/fem/large_strain/model.h"

namespace palpate::fem {

/// Equilibria of a block near given forces, one per load.
struct GridPress {
  std::array<uint32_t, 3> cells{};  ///< of the model, which may be a quarter's
  bool quarter = false;
  std::vector<PressedState> states;
  std::vector<PressedSurface> surfaces;
  std::vector<double> force_N;  ///< reached; within force_tolerance() of those that were asked for

  /// The states are of the same part of the block.
  bool serves(const LargeStrainModel& model) const;
};

/// How far, as a share, a force may be off the one asked for where maps at so many loads are there to
/// interpolate between (weights_through_origin()): what that leaves is below 1e-4 of the pressure.
double force_tolerance(size_t loads);

/// Presses to forces that rise. `near`: states of the same loads, whose ways and fields the search starts
/// from, load by load, each corrected by what the last load's differed; null, or of no use: from rest in
/// steps, as PlatePress. None where no equilibrium was found.
std::optional<GridPress> press_to_forces(const Scene& scene, LargeStrainModel& model,
                                         const LargeStrainOptions& options,
                                         const std::vector<double>& force_N, const GridPress* near,
                                         LargeStrainResult& result);

}  // namespace palpate::fem
