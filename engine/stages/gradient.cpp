#include "engine/stages/gradient.h"

#include <cmath>
#include <numeric>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "shaders/gradient.spv.h"
#include "shaders/gradient_color.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kWorkgroup = 64;
constexpr uint32_t kColumns = 16;

}  // namespace

Gradient::Gradient(gpu::Context& context, const Sensor& sensor, const FrameFormat& format) {
  push_.width = format.width;
  push_.height = format.height;
  push_.pitch = PaddedLayout(format).pitch;
  push_.tiles_x = (format.width + kColumns - 1) / kColumns;
  push_.tiles_y = (format.height + shared::kGradientRows - 1) / shared::kGradientRows;
  push_.limit = static_cast<uint32_t>(std::lround(sensor.gradient_gray_per_px * shared::kGradientUnits));
  const gpu::Shader shader = format.channels == 3 ? gpu::Shader{"gradient_color", k_gradient_color}
                                                  : gpu::Shader{"gradient", k_gradient};
  using enum gpu::Binding;
  kernel_ = gpu::Kernel(context, shader,
                        {{Texels, Texels, Texels, Texels, Storage},
                         sizeof push_,
                         {kWorkgroup, 1, 1},
                         {sensor.background.kind == BackgroundKind::Untouched}});
}

void Gradient::record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                      const gpu::DeviceBuffer& sums) const {
  const auto scope = commands.scope("gradient");
  const uint32_t tiles = push_.tiles_x * push_.tiles_y;
  commands.dispatch(kernel_,
                    {&frame.texels(), &frame.words(), &background.texels(), &background.words(), &sums},
                    push_, {(tiles + kWorkgroup - 1) / kWorkgroup, 1, 1});
  commands.barrier();
}

uint64_t Gradient::sum(std::span<const uint32_t> sums) const {
  const auto tiles = sums.first(size_t{push_.tiles_x} * push_.tiles_y);
  return std::accumulate(tiles.begin(), tiles.end(), uint64_t{0});
}

}  // namespace palpate
