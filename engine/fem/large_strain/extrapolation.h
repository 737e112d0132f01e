// Richardson extrapolation of two grids to cells of no size.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/fem/large_strain/press.h"

namespace palpate::fem {

/// How errors of a grid shrink with its cells: with these powers of their size. The part of them that the rim
/// of a bonded floor makes is measured by itself (rim_error.h) and taken away first. Of bricks the pressure's
/// order was found on 24 to 64 cells along x against cells that follow the lump's surface, for five lumps of
/// 6 to 10 mm and stiffness ratios of 5 to 15: a lump's bent border in straight cells costs it some.
inline constexpr double kPressureOrder = 1.8;
/// Order of convergence of cells that follow the lump's surface.
inline constexpr double kFittedOrder = 2;
/// Order of the force, rim included, where the rim cannot be measured: between the 1.2 of small presses and
/// the 0.7 of 20 % of the thickness.
inline constexpr double kForceOrder = 0.9;
/// Limit for cells of no size, as a fraction of the difference from the coarser to the finer grid that
/// is added to the finer's: cells along one side of both.
double extrapolation_fraction(uint32_t cells, uint32_t coarser, double order);

/// The finest grid of which both are multiples along all sides: cells that follow a lump are chosen on it.
/// None where it has fewer than 12 cells along x or y, or 6 along z.
std::optional<std::array<uint32_t, 3>> common_cells(const std::array<uint32_t, 3>& cells,
                                                    const std::array<uint32_t, 3>& coarser);

/// The same on the scene's cells and on `coarser` ones of the same proportions, and from the two what cells
/// of no size would give: pressures, and forces or ways. Where they have common_cells() (64 and 48: 16)
/// and the scene neither a pad nor other inclusions, both follow the inclusion's surface: on 64 and 32 cells
/// of 40 mm a cylinder's face is right to 0.05 mm, a ball's to 0.02. Bricks on 64 and 40 misplace it by up to
/// 0.3 mm, as it happens to lie between their planes. The rim's part of force and pressure is measured
/// without the lump on grids that cost a twentieth of the two. Loads say how far off they may be. Throws
/// Error(Failure::Usage) where the cells do not have the same proportions, or not as large a share of their
/// layers in a skin.
LargeStrainResult solve_extrapolated(const Scene& scene, const std::array<uint32_t, 3>& coarser,
                                     const std::vector<PressLoad>& loads,
                                     const LargeStrainOptions& options = {});
/// On the scene's cells, an even number along each side, and half as many.
LargeStrainResult solve_extrapolated(const Scene& scene, const std::vector<PressLoad>& loads,
                                     const LargeStrainOptions& options = {});

}  // namespace palpate::fem
