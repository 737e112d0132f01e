#include "engine/stages/surface/rest_correction.h"

#include <algorithm>
#include <cmath>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/workgroups.h"
#include "shaders/rest_correction.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kSmoothing_cells = 2;

}  // namespace

RestCorrection::RestCorrection(gpu::Context& context, const Grid& grid)
    : cells_(context, grid), push_(cells_.push()), membrane_(push_.cells_x, push_.cells_y) {
  levels_.resize(size_t{push_.cells_x} * push_.cells_y);
  scratch_.resize(levels_.size());
  depth_mm_.resize(levels_.size());
  using enum gpu::Binding;
  kernel_ = gpu::Kernel(context, {"rest_correction", k_rest_correction},
                        {{Texels, Texels, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {}});
}

RestCorrection::Slot RestCorrection::slot(gpu::Context& context) const {
  const uint64_t bytes = levels_.size() * sizeof(float);
  Slot slot{gpu::DeviceBuffer(context, "cell heights", bytes, gpu::Memory::Readback),
            gpu::DeviceBuffer(context, "rest levels", bytes, gpu::Memory::Upload),
            {}};
  slot.level_texels = gpu::TexelView(context, slot.levels, VK_FORMAT_R32_SFLOAT);
  return slot;
}

void RestCorrection::record_means(gpu::Commands& commands, const FloatMap& depth, const Slot& slot) const {
  cells_.record(commands, depth, slot.means);
}

bool RestCorrection::find(const Slot& slot, std::span<const uint8_t> at_rest) {
  const auto count = std::ranges::count_if(at_rest, [](uint8_t rest) { return rest != 0; });
  if (static_cast<double>(count) < kLeastAtRest * static_cast<double>(at_rest.size())) return false;
  slot.means.invalidate();
  const auto means = slot.means.as<const float>();
  std::copy_n(means.begin(), levels_.size(), levels_.begin());
  membrane_.fill(levels_, at_rest);
  // A narrow bump is not the surface's error, but perhaps a touch that was not noticed.
  for (int pass = 0; pass < 2; ++pass) smooth();
  double sum = 0, squares = 0;
  for (size_t i = 0; i < levels_.size(); ++i) {
    depth_mm_[i] = means[i] - levels_[i];
    if (at_rest[i] == 0) continue;
    sum += double{means[i]};
    squares += std::pow(double{means[i]}, 2);
  }
  const auto n = static_cast<double>(count);
  error_mm_ = std::sqrt(std::max(squares / n - std::pow(sum / n, 2), 0.0));
  std::ranges::copy(levels_, slot.levels.as<float>().begin());
  slot.levels.flush();
  return true;
}

void RestCorrection::smooth() {
  const uint32_t width = push_.cells_x, height = push_.cells_y;
  // As far to both sides: a tilt stays one up to the border.
  const auto reach = [](uint32_t i, uint32_t length) {
    return std::min({kSmoothing_cells, i, length - 1 - i});
  };
  for (uint32_t y = 0; y < height; ++y) {
    const float* from = levels_.data() + size_t{y} * width;
    for (uint32_t x = 0; x < width; ++x) {
      const uint32_t r = reach(x, width);
      float sum = 0;
      for (uint32_t k = x - r; k <= x + r; ++k) sum += from[k];
      scratch_[size_t{y} * width + x] = sum / static_cast<float>(2 * r + 1);
    }
  }
  for (uint32_t y = 0; y < height; ++y) {
    const uint32_t r = reach(y, height);
    float* to = levels_.data() + size_t{y} * width;
    std::fill_n(to, width, 0.0f);
    for (uint32_t k = y - r; k <= y + r; ++k)
      for (uint32_t x = 0; x < width; ++x) to[x] += scratch_[size_t{k} * width + x];
    for (uint32_t x = 0; x < width; ++x) to[x] /= static_cast<float>(2 * r + 1);
  }
}

void RestCorrection::record(gpu::Commands& commands, const FloatMap& depth, const Slot& slot) const {
  const auto scope = commands.scope("rest correction");
  const uint32_t cells = push_.cells_x * push_.cells_y;
  commands.dispatch(kernel_, {&slot.level_texels, &depth.texels, &depth.buffer}, push_, workgroups(cells));
  commands.barrier();
}

}  // namespace palpate
