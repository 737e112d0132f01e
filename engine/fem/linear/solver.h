// The equations of the forward model, solved: conjugate gradients in double precision, preconditioned in
// single precision. (All in single precision with refinement around it restarts too often: 1.5 times the
// iterations at nu = 0.499, no convergence at a stiffness ratio of 1e4.)
#pragma once

#include <cstdint>
#include <vector>

#include "engine/fem/linear/multigrid.h"
#include "engine/numeric/conjugate_gradients.h"

namespace palpate::fem {

struct SolveStatistics {
  bool converged = false;
  double residual = 0;  ///< norm of the forces that are out of balance over that of all forces (supports' and
                        ///< loads'), in double precision, of the displacement returned
  uint32_t iterations = 0;
};

/// How often the recursion's residual is replaced by the true one before rounding is said to lead.
inline constexpr int kMostRounds = 4;

class Solver {
 public:
  /// Keeps the grid, which outlives it.
  Solver(const CellGrid& grid, double poisson, FixedNodes fixed, WorkTeam& team);

  /// K displacement = load at every displacement that is not fixed. In: fixed values, and a first guess
  /// elsewhere. Both 3 x nodes. Ends at `residual` or, not converged, after `most_iterations` or where
  /// rounding lets it gain nothing more.
  SolveStatistics solve(const std::vector<double>& load, std::vector<double>& displacement, double residual,
                        uint32_t most_iterations);

  /// Forces of a displacement on all nodes: at fixed ones what the supports push with.
  void forces(const std::vector<double>& displacement, std::vector<double>& force);

  const FixedNodes& fixed() const { return fixed_; }
  const Stiffness& stiffness() const { return multigrid_.finest(); }
  uint64_t bytes() const;

 private:
  double out_of_balance(const std::vector<double>& load, const std::vector<double>& displacement);

  const CellGrid& grid_;
  FixedNodes fixed_;
  WorkTeam alone_{1};  // small grids are done faster by one thread
  WorkTeam& team_;
  Multigrid multigrid_;
  double all_forces_ = 0;  // norm of supports' and loads', as out_of_balance() found it
  ConjugateGradients gradients_;
  std::vector<double> residual_, product_;
};

}  // namespace palpate::fem
