// The kernels of the surface stage in their two forms, strips and tiles.
#include <algorithm>

#include "engine/base/divide_up.h"
#include "engine/gpu/context.h"
#include "engine/stages/surface/surface.h"
#include "shaders/ascend.spv.h"
#include "shaders/ascend_corrected_tile.spv.h"
#include "shaders/ascend_tile.spv.h"
#include "shaders/coarse_levels.spv.h"
#include "shaders/correct.spv.h"
#include "shaders/correct_tile.spv.h"
#include "shaders/descend.spv.h"
#include "shaders/descend_tile.spv.h"
#include "shaders/interpolate.spv.h"
#include "shaders/interpolate_corrected_tile.spv.h"
#include "shaders/interpolate_tile.spv.h"
#include "shaders/restrict_residual.spv.h"
#include "shaders/restrict_residual_tile.spv.h"
#include "shaders/smooth.spv.h"
#include "shaders/smooth_tile.spv.h"

namespace palpate {
namespace {

// Invocations of coarse_levels.comp, where the device has so many.
constexpr uint32_t kCoarseInvocations = 1024;

}  // namespace

gpu::KernelInterface Surface::interface(std::vector<gpu::Binding> bindings, bool in_tiles) const {
  const uint32_t workgroup = tiled() && !in_tiles ? kSmallWorkgroup : tuning_.surface_workgroup;
  return {std::move(bindings), sizeof(shared::GridPush), {workgroup, 1, 1}, {}};
}

void Surface::make_coarse_levels(gpu::Context& context) {
  const auto last = static_cast<uint32_t>(levels_.size()) - 1;
  const VkPhysicalDeviceLimits& limits = context.properties().limits;
  const uint64_t room = limits.maxComputeSharedMemorySize / sizeof(float);
  // Level 1 may have sources at its edge, and is big. The finest level needs one word a cell, others two.
  uint64_t words = 0, cells = 0;
  for (coarse_first_ = last + 1; coarse_first_ > 2 && last + 1 - coarse_first_ < shared::kCoarseLevels;
       --coarse_first_) {
    const Grid& grid = levels_[coarse_first_ - 1].grid;
    const uint64_t more = uint64_t{grid.width} * grid.height;
    if (words + cells + more > room) break;
    words += cells + more;
    cells = more;
  }
  if (coarse_first_ >= last) {
    coarse_first_ = 0;
    return;
  }
  inverse_words_ = gpu::TexelView(context, inverse_, VK_FORMAT_R32_SFLOAT);
  using enum gpu::Binding;
  gpu::KernelInterface of_levels = interface({Texels, Texels, Storage}, true);
  of_levels.push_bytes = sizeof(shared::CoarsePush);
  of_levels.local_size[0] = std::min(kCoarseInvocations, limits.maxComputeWorkGroupInvocations);
  for (const auto& [kernel, full] : {std::pair{&coarse_pass_, 1u}, {&coarse_cycle_, 0u}}) {
    of_levels.constants = {full, static_cast<uint32_t>(words),
                           divide_up(static_cast<uint32_t>(cells), of_levels.local_size[0])};
    *kernel = gpu::Kernel(context, {"coarse_levels", k_coarse_levels}, of_levels);
  }
}

void Surface::make_strips(gpu::Context& context) {
  using enum gpu::Binding;
  const auto make = [&](const gpu::Shader& shader, std::vector<gpu::Binding> bindings) {
    return gpu::Kernel(context, shader, interface(std::move(bindings), false));
  };
  descend_ = make({"descend", k_descend}, {Texels, Texels, Storage, Storage});
  ascend_ = make({"ascend", k_ascend}, {Texels, Texels, Texels, Storage, Storage});
  interpolate_ = make({"interpolate", k_interpolate}, {Texels, Texels, Storage});
  correct_ = make({"correct", k_correct}, {Texels, Texels, Storage});
}

void Surface::make_tiles(gpu::Context& context) {
  using enum gpu::Binding;
  const auto make = [&](const gpu::Shader& shader, std::vector<gpu::Binding> bindings) {
    return gpu::Kernel(context, shader, interface(std::move(bindings), true));
  };
  descend_ = make({"descend_tile", k_descend_tile}, {Texels, Storage, Storage});
  ascend_ = make({"ascend_tile", k_ascend_tile}, {Texels, Texels, Storage, Storage});
  ascend_corrected_ =
      make({"ascend_corrected_tile", k_ascend_corrected_tile}, {Texels, Texels, Storage, Storage, Texels});
  interpolate_ = make({"interpolate_tile", k_interpolate_tile}, {Texels, Storage});
  interpolate_corrected_ =
      make({"interpolate_corrected_tile", k_interpolate_corrected_tile}, {Texels, Storage, Texels});
  correct_ = make({"correct_tile", k_correct_tile}, {Texels, Texels, Storage});
  make_coarse_levels(context);
}

// Makes the kernels that correct a solution that is there already.
void Surface::make_correcting(gpu::Context& context) {
  using enum gpu::Binding;
  if (tiled()) {
    smooth_ = gpu::Kernel(context, {"smooth_tile", k_smooth_tile},
                          interface({Texels, Texels, Storage, Texels}, true));
    restrict_residual_ = gpu::Kernel(context, {"restrict_residual_tile", k_restrict_residual_tile},
                                     interface({Texels, Texels, Storage}, true));
    return;
  }
  smooth_ =
      gpu::Kernel(context, {"smooth", k_smooth}, interface({Texels, Texels, Texels, Texels, Storage}, false));
  restrict_residual_ = gpu::Kernel(context, {"restrict_residual", k_restrict_residual},
                                   interface({Texels, Texels, Texels, Storage}, false));
}

}  // namespace palpate
