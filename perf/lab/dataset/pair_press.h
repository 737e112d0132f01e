// Presses of blocks with two lumps.
#pragma once

#include "engine/fem/large_strain/large_strain.h"

namespace palpate::lump {

/// A scene with one other inclusion, each of the two at its own best: on cells that follow its surface, by
/// two grids. What two together make beyond the sum of both alone comes from straight cells of the scene's
/// grid, on which all errors of the border cancel. Five presses, about four times a single lump's. Throws
/// as solve_extrapolated().
fem::LargeStrainResult press_pair(const fem::Scene& scene, const std::array<uint32_t, 3>& coarser_cells,
                                  const std::vector<fem::PressLoad>& loads,
                                  const fem::LargeStrainOptions& options);

}  // namespace palpate::lump
