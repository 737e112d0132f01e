// SurfaceSolver::Auto: which solver it stands for.
#pragma once

#include "palpate/frame.h"
#include "palpate/options.h"
#include "palpate/sensor.h"

namespace palpate {
struct FramePlan;

/// Any other solver is taken as it is. On a GPU Converged. On a `processor`'s own driver Exact where FFTW
/// needs few operations for the size, which is then faster (6 instead of 11 ms at 640 x 480, perf/results),
/// but not where frames are solved in windows or with weights: Exact is slow there.
SurfaceSolver choose_solver(SurfaceSolver asked, const FramePlan& plan, const FrameFormat& format,
                            bool processor);
/// The same for gradients of a size, without weights.
SurfaceSolver choose_solver(SurfaceSolver asked, uint32_t width, uint32_t height, bool processor);

}  // namespace palpate
