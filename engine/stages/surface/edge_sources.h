// Edge sources: what makes the whole grid's solution that of its known part (engine/numeric/capacitance.h),
// on the GPU.
#pragma once

#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/numeric/capacitance.h"
#include "engine/stages/surface/surface_grid.h"
#include "shaders/shared/grid.h"

namespace palpate {
namespace gpu {
class Commands;
}

class EdgeSources {
 public:
  /// For maps of `grid`; `edge` has cells.
  EdgeSources(gpu::Context& context, const Capacitance& edge, const Grid& grid);

  /// Adds sources to `right` by what flows through missing faces in `x`. `first`: the first of this solve, so
  /// that `right` holds none yet.
  void record(gpu::Commands& commands, const FloatMap& right, const FloatMap& x, bool first) const;

  uint64_t memory_bytes() const;

 private:
  shared::EdgePush push_{};
  gpu::DeviceBuffer cells_, weights_, matrix_, residual_, sources_;
  gpu::TexelView cell_words_, weight_texels_, matrix_texels_, residual_words_, source_words_;
  gpu::Kernel residual_kernel_, sources_kernel_;
};

}  // namespace palpate
