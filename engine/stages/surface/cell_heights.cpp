#include "engine/stages/surface/cell_heights.h"

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/workgroups.h"
#include "shaders/rest_cells.spv.h"

namespace palpate {
namespace {

uint32_t cells_along(uint32_t pixels) {
  return divide_up(pixels, shared::kCellSide);
}

}  // namespace

CellHeights::CellHeights(gpu::Context& context, const Grid& grid) {
  push_.width = grid.width;
  push_.height = grid.height;
  push_.pitch = grid.pitch;
  push_.cells_x = cells_along(grid.width);
  push_.cells_y = cells_along(grid.height);
  using enum gpu::Binding;
  kernel_ = gpu::Kernel(context, {"rest_cells", k_rest_cells},
                        {{Texels, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {}});
}

void CellHeights::record(gpu::Commands& commands, const FloatMap& depth,
                         const gpu::DeviceBuffer& means) const {
  const auto scope = commands.scope("cell heights");
  const uint32_t cells = push_.cells_x * push_.cells_y;
  commands.dispatch(kernel_, {&depth.texels, &means}, push_, workgroups(cells));
  commands.barrier();
}

}  // namespace palpate
