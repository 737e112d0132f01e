#include "engine/stages/rest_correction.h"

#include <algorithm>
#include <cmath>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "shaders/rest_correction.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kWorkgroup = 64;
constexpr uint32_t kSmoothing_cells = 2;

}  // namespace

RestCorrection::RestCorrection(gpu::Context& context, const Grid& grid)
    : cells_(context, grid), push_(cells_.push()), membrane_(push_.cells_x, push_.cells_y) {
  levels_.resize(size_t{push_.cells_x} * push_.cells_y);
  scratch_.resize(levels_.size());
  depth_mm_.resize(levels_.size());
  using enum gpu::Binding;
  kernel_ = gpu::Kernel(context, {"rest_correction", k_rest_correction},
                        {{Storage, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {}});
}

RestCorrection::Slot RestCorrection::slot(gpu::Context& context) const {
  const uint64_t bytes = levels_.size() * sizeof(float);
  return {gpu::DeviceBuffer(context, "cell heights", bytes, gpu::Memory::Readback),
          gpu::DeviceBuffer(context, "rest levels", bytes, gpu::Memory::Upload)};
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
  // What is narrow is not the surface's error, but perhaps a touch that was not noticed.
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
  const auto along = [&](const std::vector<float>& from, std::vector<float>& to, uint32_t lines,
                         uint32_t length, size_t line_step, size_t step) {
    for (uint32_t line = 0; line < lines; ++line)
      for (uint32_t i = 0; i < length; ++i) {
        // As far to both sides: a tilt stays one up to the border.
        const uint32_t reach = std::min({kSmoothing_cells, i, length - 1 - i});
        const uint32_t first = i - reach, last = i + reach;
        float sum = 0;
        for (uint32_t k = first; k <= last; ++k) sum += from[line * line_step + k * step];
        to[line * line_step + i * step] = sum / static_cast<float>(last - first + 1);
      }
  };
  along(levels_, scratch_, height, width, width, 1);
  along(scratch_, levels_, width, height, 1, width);
}

void RestCorrection::record(gpu::Commands& commands, const FloatMap& depth, const Slot& slot) const {
  const auto scope = commands.scope("rest correction");
  const uint32_t texels = push_.cells_x * push_.height;
  commands.dispatch(kernel_, {&slot.levels, &depth.buffer}, push_,
                    {(texels + kWorkgroup - 1) / kWorkgroup, 1, 1});
  commands.barrier();
}

}  // namespace palpate
