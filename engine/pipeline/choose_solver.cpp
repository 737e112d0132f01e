#include "engine/pipeline/choose_solver.h"

#include "engine/numeric/poisson_dct.h"
#include "engine/pipeline/plan.h"

namespace palpate {
namespace {

// For each pixel: up to here FFTW took 16 to 51 ns at sizes from 160 x 120 to 2048 x 1536, the multigrid 36
// to 58 on the same two cores; sizes with a large prime factor need 200 operations and 54 ns or more.
constexpr double kMostOperations = 150;

}  // namespace

SurfaceSolver choose_solver(SurfaceSolver asked, const FramePlan& plan, const FrameFormat& format,
                            bool processor) {
  if (asked != SurfaceSolver::Auto) return asked;
  const bool transforms = plan.surface == SurfaceKind::Gradient && !plan.weights && !plan.windowed;
  return transforms ? choose_solver(asked, format.width, format.height, processor) : SurfaceSolver::Converged;
}

SurfaceSolver choose_solver(SurfaceSolver asked, uint32_t width, uint32_t height, bool processor) {
  if (asked != SurfaceSolver::Auto) return asked;
  const bool exact = processor && PoissonDct::operations(width, height) <= kMostOperations;
  return exact ? SurfaceSolver::Exact : SurfaceSolver::Converged;
}

}  // namespace palpate
