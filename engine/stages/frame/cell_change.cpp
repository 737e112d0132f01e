#include "engine/stages/frame/cell_change.h"

#include <cassert>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/workgroups.h"
#include "shaders/cell_change.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kCellsPerTexel = 4;

}  // namespace

CellChangeStage::CellChangeStage(gpu::Context& context, const FrameFormat& format) {
  assert(format.channels == 3 && format.bit_depth == 8);
  push_.width = format.width;
  push_.height = format.height;
  push_.pitch = PaddedLayout(format).pitch;
  push_.cells_x = divide_up(format.width, shared::kCellSide);
  push_.cells_y = divide_up(format.height, shared::kCellSide);
  using enum gpu::Binding;
  kernel_ = gpu::Kernel(context, {"cell_change", k_cell_change},
                        {{Texels, Texels, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {}});
}

void CellChangeStage::record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                             const gpu::DeviceBuffer& cells) const {
  const auto scope = commands.scope("cell change");
  const uint32_t texels = divide_up(push_.cells_x, kCellsPerTexel) * push_.cells_y;
  commands.dispatch(kernel_, {&frame.texels(), &background.texels(), &cells}, push_, workgroups(texels));
  commands.barrier();
}

}  // namespace palpate
