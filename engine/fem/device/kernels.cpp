#include "engine/fem/device/kernels.h"

#include <utility>
#include <vector>

#include "engine/fem/device/grid.h"
#include "engine/gpu/context.h"
#include "shaders/forward_advance.spv.h"
#include "shaders/forward_balance.spv.h"
#include "shaders/forward_coarsest.spv.h"
#include "shaders/forward_direction.spv.h"
#include "shaders/forward_first.spv.h"
#include "shaders/forward_narrow.spv.h"
#include "shaders/forward_prolong.spv.h"
#include "shaders/forward_residual.spv.h"
#include "shaders/forward_restrict.spv.h"
#include "shaders/forward_scalars.spv.h"
#include "shaders/forward_step.spv.h"
#include "shaders/forward_step_dot.spv.h"
#include "shaders/forward_wide.spv.h"

namespace palpate::fem {

Kernels::Kernels(gpu::Context& context, bool unequal) : layered(unequal) {
  using enum gpu::Binding;
  constexpr uint32_t kGroup = DeviceGrid::kWorkgroup;
  const uint32_t layers = unequal ? 1 : 0;
  const auto make = [&](const gpu::Shader& shader, std::vector<gpu::Binding> bindings, size_t push_bytes,
                        std::vector<uint32_t> constants) {
    return gpu::Kernel(
        context, shader,
        {std::move(bindings), static_cast<uint32_t>(push_bytes), {kGroup, 1, 1}, std::move(constants)});
  };

  const gpu::Shader stepping = {"forward_step", k_forward_step};
  const std::vector<gpu::Binding> step_bindings = {Texels, Texels, Texels,  Texels,
                                                   Texels, Texels, Storage, Storage};
  std::vector<gpu::Binding> dot_bindings = step_bindings;
  dot_bindings.push_back(Storage);
  const size_t step_push = sizeof(shared::ForwardStepPush);
  // Constants: layered, the last step counts, another step comes.
  fresh_step = make(stepping, step_bindings, step_push, {layers, 0, 1});
  step = make(stepping, step_bindings, step_push, {layers, 1, 1});
  last_step = make(stepping, step_bindings, step_push, {layers, 1, 0});
  last_step_dot = make({"forward_step_dot", k_forward_step_dot}, dot_bindings, step_push, {layers, 1, 0});
  residual = make({"forward_residual", k_forward_residual}, {Texels, Texels, Texels, Texels, Texels, Storage},
                  step_push, {layers});
  first = make({"forward_first", k_forward_first}, {Texels, Texels, Storage, Storage},
               sizeof(shared::ForwardNodesPush), {});
  restriction = make({"forward_restrict", k_forward_restrict}, {Texels, Texels, Texels, Storage},
                     sizeof(shared::ForwardTransferPush), {});
  prolongation = make({"forward_prolong", k_forward_prolong}, {Texels, Texels, Texels, Texels, Storage},
                      sizeof(shared::ForwardTransferPush), {});
  coarsest = make({"forward_coarsest", k_forward_coarsest}, {Texels, Texels, Storage},
                  sizeof(shared::ForwardNodesPush), {});

  const size_t wide_push = sizeof(shared::ForwardWidePush);
  balance = make({"forward_balance", k_forward_balance},
                 {Texels, Texels, Texels, Texels, Storage, Storage, Texels}, wide_push, {layers});
  product = make({"forward_wide", k_forward_wide}, {Texels, Texels, Texels, Texels, Storage, Storage},
                 wide_push, {layers});
  const size_t vector_push = sizeof(shared::ForwardNodesPush);
  const std::vector<uint32_t> each = {DeviceGrid::kNodesEach};
  narrow = make({"forward_narrow", k_forward_narrow}, {Storage, Texels, Storage}, vector_push, each);
  direction =
      make({"forward_direction", k_forward_direction}, {Storage, Texels, Texels, Storage}, vector_push, each);
  advance =
      make({"forward_advance", k_forward_advance},
           {Storage, Texels, Storage, Texels, Texels, Texels, Storage, Storage, Storage}, vector_push, each);
  scalars = make({"forward_scalars", k_forward_scalars}, {Texels, Storage}, sizeof(shared::ForwardScalarPush),
                 {kGroup});
}

}  // namespace palpate::fem
