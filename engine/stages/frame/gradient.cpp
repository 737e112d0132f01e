#include "engine/stages/frame/gradient.h"

#include <cmath>
#include <numeric>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/workgroups.h"
#include "shaders/gradient.spv.h"
#include "shaders/gradient_color.spv.h"
#include "shaders/gradient_tile.spv.h"
#include "shaders/gradient_tile_color.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kColumns = 16;
// Tile of gradient_tile.comp, whose workgroup owns as many words.
constexpr uint32_t kGradientTileColumns = 32, kGradientTileRows = 8;

gpu::Shader shader_for(bool color, bool tiled) {
  if (tiled && color) return {"gradient_tile_color", k_gradient_tile_color};
  if (tiled) return {"gradient_tile", k_gradient_tile};
  if (color) return {"gradient_color", k_gradient_color};
  return {"gradient", k_gradient};
}

}  // namespace

Gradient::Gradient(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                   const Tuning& tuning)
    : tiled_(tuning.contact_tiles != 0) {
  push_.width = format.width;
  push_.height = format.height;
  push_.pitch = PaddedLayout(format).pitch;
  push_.tiles_x = divide_up(format.width, tiled_ ? kGradientTileColumns : kColumns);
  push_.tiles_y = divide_up(format.height, tiled_ ? kGradientTileRows : shared::kGradientRows);
  push_.limit = static_cast<uint32_t>(std::lround(sensor.gradient_gray_per_px * shared::kGradientUnits));
  using enum gpu::Binding;
  std::vector<gpu::Binding> bindings(tiled_ ? 2 : 4, Texels);
  bindings.push_back(Storage);
  kernel_ = gpu::Kernel(context, shader_for(format.channels == 3, tiled_),
                        {std::move(bindings),
                         sizeof push_,
                         {kWorkgroup, 1, 1},
                         {sensor.background.kind == BackgroundKind::Untouched}});
}

void Gradient::record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                      const gpu::DeviceBuffer& sums) const {
  const auto scope = commands.scope("gradient");
  if (tiled_) {
    commands.dispatch(kernel_, {&frame.words(), &background.words(), &sums}, push_,
                      {push_.tiles_x, push_.tiles_y, 1});
  } else {
    commands.dispatch(kernel_,
                      {&frame.texels(), &frame.words(), &background.texels(), &background.words(), &sums},
                      push_, workgroups(push_.tiles_x * push_.tiles_y));
  }
  commands.barrier();
}

uint64_t Gradient::sum(std::span<const uint32_t> sums) const {
  const auto tiles = sums.first(size_t{push_.tiles_x} * push_.tiles_y);
  return std::accumulate(tiles.begin(), tiles.end(), uint64_t{0});
}

}  // namespace palpate
