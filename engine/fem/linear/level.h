// One grid of the forward model's V-cycle with all that its smoothing needs, on the processor and the device
// alike.
#pragma once

#include <optional>
#include <vector>

#include "engine/fem/linear/stiffness.h"

namespace palpate::fem {

/// d = keep * last d + gain * B r, where B is the inverse of the 3 x 3 diagonal blocks.
struct ChebyshevStep {
  double keep, gain;
};

/// How a level is smoothed: by steps before the coarser grid, and as many after it, made for a spread of the
/// highest over the lowest eigenvalue.
struct Smoothing {
  uint32_t steps;
  double spread;
};
/// Sixteen steps cost less time than four, and far fewer iterations where tissue is nearly incompressible: at
/// nu = 0.4999 and a stiffness ratio of 1e4 218 instead of 810 to 1e-8 on 32 x 32 x 16 cells.
inline constexpr Smoothing kThorough = {16, 40};

/// Steps for a grid whose scaled matrix has no eigenvalue above `highest`.
std::vector<ChebyshevStep> chebyshev_steps(double highest, const Smoothing& smoothing);

struct GridLevel {
  std::optional<CellGrid> own_grid;  ///< none on the finest: it is the caller's
  std::optional<FixedNodes> own_fixed;
  const CellGrid& grid;
  const FixedNodes& fixed;
  Stiffness stiffness;
  std::vector<ChebyshevStep> steps;

  /// Keeps both, which outlive it.
  GridLevel(const CellGrid& grid, double poisson, const FixedNodes& fixed,
            const Smoothing& smoothing = kThorough);
  GridLevel(CellGrid&& grid, double poisson, FixedNodes&& fixed, const Smoothing& smoothing = kThorough);
  GridLevel(const GridLevel&) = delete;
  GridLevel& operator=(const GridLevel&) = delete;

  uint64_t own_bytes() const { return own_grid ? grid.young.size() * sizeof(float) + fixed.size() : 0; }
};

}  // namespace palpate::fem
