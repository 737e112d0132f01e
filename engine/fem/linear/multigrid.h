// A V-cycle over halved grids: the preconditioner of the forward model's conjugate gradients.
#pragma once

#include <memory>
#include <vector>

#include "engine/fem/linear/level.h"
#include "engine/fem/linear/stiffness.h"

namespace palpate::fem {

/// Grids with fewer nodes are done faster by one thread than handed out.
inline constexpr size_t kFewestForTeam = 4000;

/// Chebyshev smoothing with 3 x 3 diagonal blocks on each level, as many steps before as after, a direct
/// solve on the coarsest. Symmetric and positive definite. Single precision: what it makes is a correction.
class Multigrid {
 public:
  /// Keeps `grid`, `fixed` and `team`, which outlive it. Throws Error(Failure::Usage) where the grid cannot
  /// be halved down to a size that a direct solve takes.
  Multigrid(const CellGrid& grid, double poisson, const FixedNodes& fixed, WorkTeam& team,
            const Smoothing& smoothing = kThorough);
  ~Multigrid();
  Multigrid(const Multigrid&) = delete;
  Multigrid& operator=(const Multigrid&) = delete;

  /// correction, about the solution of K correction = residual; 3 x nodes each. The residual of fixed
  /// displacements is zero, and so is their correction.
  void precondition(const float* residual, float* correction);

  const Stiffness& finest() const;
  uint64_t bytes() const;

 private:
  struct Level;
  struct Coarsest;
  void cycle(size_t level);
  void smooth(Level& level, bool from_zero);

  std::vector<std::unique_ptr<Level>> levels_;
  std::unique_ptr<Coarsest> coarsest_;
  WorkTeam& team_;
  WorkTeam alone_{1};
};

}  // namespace palpate::fem
