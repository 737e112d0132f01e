#include "engine/stages/surface/rest_level.h"

#include <algorithm>
#include <limits>

#include "engine/base/divide_up.h"
#include "engine/base/simd.h"
#include "engine/gpu/commands.h"
#include "engine/stages/frame/contact.h"
#include "shaders/rest_level.spv.h"

namespace palpate {
namespace {

struct Mean {
  double sum = 0;
  double count = 0;
  void add(const shared::RestLevelRecord& r) {
    sum += double{r.mean} * r.pixels;
    count += r.pixels;
  }
};

/// As the kernel: four sums and maxima, which are added last.
struct TileMean {
  const float* from;
  size_t pitch;
  uint32_t pixels, rows;
  shared::RestLevelRecord* record;

  PALPATE_INLINE void run() const {
    constexpr uint32_t kLanes = 4;
    float sums[kLanes] = {}, highest[kLanes];
    std::fill_n(highest, kLanes, -3.4e38f);
    for (uint32_t y = 0; y < rows; ++y) {
      const float* row = from + y * pitch;
      uint32_t x = 0;
      for (; x + kLanes <= pixels; x += kLanes)
        for (uint32_t k = 0; k < kLanes; ++k) {
          sums[k] += row[x + k];
          highest[k] = std::max(highest[k], row[x + k]);
        }
      for (uint32_t k = 0; x < pixels; ++x, ++k) {
        sums[k] += row[x];
        highest[k] = std::max(highest[k], row[x]);
      }
    }
    record->mean =
        (sums[0] + sums[1] + sums[2] + sums[3]) / std::max(static_cast<float>(pixels * rows), 1.0f);
    record->highest = std::max(std::max(highest[0], highest[1]), std::max(highest[2], highest[3]));
  }
};

}  // namespace

RestLevel::RestLevel(gpu::Context& context, const Contact& contact, const Grid& grid, const Tuning& tuning)
    : workgroup_(tuning.rest_level_workgroup) {
  push_.width = grid.width;
  push_.height = grid.height;
  push_.pitch = grid.pitch;
  push_.tiles_x = contact.tiles_x();
  push_.tiles_y = contact.tiles() / contact.tiles_x();
  push_.tile_texels = contact.tile_columns() / 4;
  push_.tile_rows = contact.tile_rows();
  kernel_ = gpu::Kernel(context, {"rest_level", k_rest_level},
                        {{gpu::Binding::Texels, gpu::Binding::Storage, gpu::Binding::Storage},
                         sizeof push_,
                         {workgroup_, 1, 1},
                         {}});
}

uint64_t RestLevel::record_bytes() const {
  return uint64_t{push_.tiles_x} * push_.tiles_y * sizeof(shared::RestLevelRecord);
}

void RestLevel::record(gpu::Commands& commands, const FloatMap& depth, const gpu::DeviceBuffer& contact,
                       const gpu::DeviceBuffer& records) const {
  const auto scope = commands.scope("rest level");
  commands.dispatch(kernel_, {&depth.texels, &contact, &records}, push_,
                    {divide_up(push_.tiles_x * push_.tiles_y, workgroup_), 1, 1});
  commands.barrier();
}

void RestLevel::measure(const HeightRows& heights, std::span<const shared::ContactRecord> contact,
                        std::span<shared::RestLevelRecord> records) const {
  const uint32_t columns = 4 * push_.tile_texels;
  for (uint32_t tile = 0; tile < push_.tiles_x * push_.tiles_y; ++tile) {
    const uint32_t x = tile % push_.tiles_x, y = tile / push_.tiles_x;
    const bool border = x == 0 || y == 0 || x + 1 == push_.tiles_x || y + 1 == push_.tiles_y;
    const uint32_t first = std::min(x * columns, push_.width), row = y * push_.tile_rows;
    const uint32_t pixels = std::min(columns, push_.width - first);
    const uint32_t rows = std::min(push_.tile_rows, push_.height - std::min(row, push_.height));
    run_widest(TileMean{heights.values.data() + size_t{row} * heights.pitch + first, heights.pitch, pixels,
                        border || contact[tile].area > 0 ? rows : std::min(rows, 1u), &records[tile]});
    records[tile].pixels = pixels * rows;
  }
}

RestHeight RestLevel::find(std::span<const shared::ContactRecord> contact,
                           std::span<const shared::RestLevelRecord> records) const {
  Mean border, untouched, all;
  double highest = std::numeric_limits<double>::lowest();
  const uint32_t tiles = push_.tiles_x * push_.tiles_y;
  for (uint32_t tile = 0; tile < tiles; ++tile) {
    const shared::RestLevelRecord& r = records[tile];
    highest = std::max(highest, double{r.highest});
    all.add(r);
    if (contact[tile].area > 0) continue;
    untouched.add(r);
    const uint32_t x = tile % push_.tiles_x, y = tile / push_.tiles_x;
    if (x == 0 || y == 0 || x + 1 == push_.tiles_x || y + 1 == push_.tiles_y) border.add(r);
  }
  const Mean& chosen = border.count > 0 ? border : untouched.count > 0 ? untouched : all;
  return {chosen.sum / chosen.count, highest, untouched.count > 0};
}

double RestLevel::volume_px_mm(std::span<const shared::ContactRecord> contact,
                               std::span<const shared::RestLevelRecord> records, double level_mm) const {
  double volume = 0;
  for (uint32_t tile = 0; tile < push_.tiles_x * push_.tiles_y; ++tile)
    if (contact[tile].area > 0) volume += (double{records[tile].mean} - level_mm) * records[tile].pixels;
  return volume;
}

}  // namespace palpate
