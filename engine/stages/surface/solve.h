// Solve: the ways to heights that SurfaceSolver and SolveBy choose from (engine/pipeline/choose_solve.h).
#pragma once

namespace palpate {

enum class Solve {
  Live,       ///< one full-multigrid pass, on cells of 2 x 2 px where there are enough
  Converged,  ///< that at full resolution and six cycles: down to the rounding of single precision
  Exact,      ///< on the host: discrete cosine transform; for SurfaceReading::Elastic zero-padded convolution
};

}  // namespace palpate
