#include "engine/stages/surface/lookup.h"

#include <algorithm>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/sensor/lookup_depth.h"
#include "engine/stages/frame/contact.h"
#include "shaders/lookup_depth.spv.h"

namespace palpate {
namespace {
constexpr uint32_t kStoredValues = 1u << 16;
// surface_workgroup may be that of a tile, for which there are too few pixels here.
constexpr uint32_t kMostLookupInvocations = 64;
}  // namespace

Lookup::Lookup(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const Contact& contact,
               const Tuning& tuning)
    : workgroup_(std::min(tuning.surface_workgroup, kMostLookupInvocations)) {
  using enum gpu::Binding;
  push_.width = format.width;
  push_.height = format.height;
  push_.in_pitch = contact.tiles_x() * contact.tile_columns() / 8;
  push_.pitch = grid_for(format.width, format.height).pitch;
  push_.rows = tuning.slope_rows;
  table_ = gpu::DeviceBuffer(context, "lookup table", kStoredValues * sizeof(float), gpu::Memory::Constant);
  const std::span<float> depths = table_.as<float>();
  const double units = contact.filtered_units_per_gray();
  for (uint32_t stored = 0; stored < kStoredValues; ++stored)
    depths[stored] = static_cast<float>(lookup_depth_mm(sensor.lookup, stored / units));
  table_.flush();
  table_words_ = gpu::TexelView(context, table_, VK_FORMAT_R32_SFLOAT);
  filtered_ = gpu::TexelView(context, contact.filtered(), VK_FORMAT_R32G32B32A32_UINT);
  kernel_ = gpu::Kernel(context, {"lookup_depth", k_lookup_depth},
                        {{Texels, Texels, Storage}, sizeof push_, {workgroup_, 1, 1}, {}});
}

void Lookup::record(gpu::Commands& commands, const FloatMap& depth) const {
  const auto scope = commands.scope("lookup");
  const uint32_t across = (push_.width + 7) / 8, strips = (push_.height + push_.rows - 1) / push_.rows;
  commands.dispatch(kernel_, {&filtered_, &table_words_, &depth.buffer}, push_,
                    {divide_up(across * strips, workgroup_), 1, 1});
  commands.barrier();
}

}  // namespace palpate
