// The forward model's kernels, compiled: they fit any grid, so that one solver after another can use them.
#pragma once

#include "engine/gpu/kernel.h"

namespace palpate::fem {

struct Kernels {
  /// `layered`: layers of cells may be of unequal height; slower, and right for equal ones too.
  Kernels(gpu::Context& context, bool layered);

  bool layered;
  // The cycle's, in single precision.
  gpu::Kernel first, fresh_step, step, last_step, last_step_dot, residual, restriction, prolongation,
      coarsest;
  // Conjugate gradients', in double precision.
  gpu::Kernel balance, product, narrow, direction, advance, scalars;
};

}  // namespace palpate::fem
