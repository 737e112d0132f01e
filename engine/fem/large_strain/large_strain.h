// The forward model at large strain: neo-Hookean tissue and inclusion pressed step by step. A
// press of 2 N on 40 x 40 mm of 4 kPa tissue is 25 % deep, where small strain is a quarter off; and only the
// way the map changes from load to load distinguishes a stiff small lump from a softer larger one.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "engine/fem/large_strain/press.h"

namespace palpate::fem {

/// Presses the scene's block with its flat plate (press_mm and force_N of `scene` are not used) up to each of
/// `loads`, which rise. W = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (Jm - 1)^2 with Jm the volume ratio of the whole
/// cell (mean dilatation, Q1-P0); mu and kappa of Young's modulus and Poisson's ratio; the scene's plate
/// (or the pad's sheets, bonded). Throws Error(Failure::Usage) for other pressers, sliding pads, loads that
/// do not rise, cells that cannot follow the inclusion, and what solve() refuses.
LargeStrainResult solve_large_strain(const Scene& scene, const std::vector<PressLoad>& loads,
                                     const LargeStrainOptions& options = {});

/// Who presses the block: solve_large_strain(), or another model of the same question.
using PressSolver = std::function<LargeStrainResult(const Scene& scene, const std::vector<PressLoad>& loads)>;

}  // namespace palpate::fem
