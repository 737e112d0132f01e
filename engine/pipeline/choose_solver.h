// SurfaceSolver::Auto: which solver it stands for.
#pragma once

#include "palpate/options.h"

namespace palpate {
struct FramePlan;

/// Any other solver is taken as it is. On a GPU Converged. On a `processor`'s own driver Exact, which takes 3
/// to 50 ns a pixel of any size there, the multigrid 36 to 58 (perf/results); but not where frames are solved
/// in windows or with weights: Exact is slow there.
SurfaceSolver choose_solver(SurfaceSolver asked, const FramePlan& plan, bool processor);
/// The same for gradients without weights.
SurfaceSolver choose_solver(SurfaceSolver asked, bool processor);

}  // namespace palpate
