#include "engine/pipeline/choose_solver.h"

#include "engine/pipeline/plan.h"

namespace palpate {

SurfaceSolver choose_solver(SurfaceSolver asked, const FramePlan& plan, bool processor) {
  const bool transforms = plan.surface == SurfaceKind::Gradient && !plan.weights && !plan.windowed;
  return choose_solver(asked, processor && transforms);
}

SurfaceSolver choose_solver(SurfaceSolver asked, bool processor) {
  if (asked != SurfaceSolver::Auto) return asked;
  return processor ? SurfaceSolver::Exact : SurfaceSolver::Converged;
}

}  // namespace palpate
