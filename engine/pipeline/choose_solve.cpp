#include "engine/pipeline/choose_solve.h"

namespace palpate {

Solve choose_solve(SurfaceSolver solver, SolveBy by, const SolveCase& what) {
  if (solver == SurfaceSolver::Live) return Solve::Live;
  if (by != SolveBy::Auto) return by == SolveBy::Host ? Solve::Exact : Solve::Converged;
  return what.processor && what.transforms ? Solve::Exact : Solve::Converged;
}

bool motion_on_host(SolveBy by, bool processor) {
  return by == SolveBy::Auto ? processor : by == SolveBy::Host;
}

bool traction_on_host(SolveBy by, Solve surface, bool processor) {
  if (by != SolveBy::Auto) return by == SolveBy::Host;
  return processor || surface == Solve::Exact;
}

}  // namespace palpate
