#include "engine/pipeline/surface/surface_sample.h"

#include <algorithm>
#include <cmath>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"

namespace palpate {
namespace {

/// The four texels around a sample, in the buffer; two and two are neighbours.
struct Corner {
  uint64_t top = 0, bottom = 0;  ///< place of the left texel, floats from the buffer's start
  float right = 0, down = 0;     ///< shares of the right and lower ones
  bool held = false;
};

Corner corner_of(const SurfaceMap& map, const std::array<double, 2>& place) {
  const double width = map.width - 1.0, height = map.height - 1.0;
  const double x = std::clamp(place[0], 0.0, width), y = std::clamp(place[1], 0.0, height);
  // The right neighbour always exists: at the edge the fraction of it is 1. A map of one column has none.
  const double left = std::clamp(std::floor(x), 0.0, std::max(0.0, width - 1));
  const double above = std::clamp(std::floor(y), 0.0, std::max(0.0, height - 1));
  Corner c;
  c.held = map.width > 1 && map.height > 1;
  if (!c.held) return c;
  c.top = static_cast<uint64_t>(above) * map.pitch + static_cast<uint64_t>(left);
  c.bottom = c.top + map.pitch;
  c.right = static_cast<float>(x - left);
  c.down = static_cast<float>(y - above);
  return c;
}

float mixed(const Corner& c, float a, float b, float d, float e) {
  const float top = a + (b - a) * c.right, bottom = d + (e - d) * c.right;
  return top + (bottom - top) * c.down;
}

}  // namespace

std::vector<float> sample_depths(gpu::Context& context, const SurfaceMap& map, double offset_mm,
                                 std::span<const std::array<double, 2>> places) {
  const size_t count = places.size();
  std::vector<Corner> corners(count);
  for (size_t i = 0; i < count; ++i) corners[i] = corner_of(map, places[i]);
  std::vector<float> depths(count);
  const auto offset = static_cast<float>(offset_mm);
  if (map.buffer->mapped()) {
    map.buffer->invalidate();
    const auto at = map.buffer->as<float>();
    for (size_t i = 0; i < count; ++i)
      if (const Corner& c = corners[i]; c.held)
        depths[i] = offset + mixed(c, at[c.top], at[c.top + 1], at[c.bottom], at[c.bottom + 1]);
    return depths;
  }
  std::vector<VkBufferCopy> regions;
  for (size_t i = 0; i < count; ++i) {
    if (!corners[i].held) continue;
    constexpr uint64_t kPair = 2 * sizeof(float);
    regions.push_back({corners[i].top * sizeof(float), i * 2 * kPair, kPair});
    regions.push_back({corners[i].bottom * sizeof(float), i * 2 * kPair + kPair, kPair});
  }
  if (regions.empty()) return depths;
  gpu::DeviceBuffer copies(context, "depth samples", count * 4 * sizeof(float), gpu::Memory::Readback);
  gpu::run_once(context, [&](gpu::Commands& commands) {
    vkCmdCopyBuffer(commands.handle(), map.buffer->handle(), copies.handle(),
                    static_cast<uint32_t>(regions.size()), regions.data());
    commands.host_barrier();
  });
  copies.invalidate();
  const auto at = copies.as<float>();
  for (size_t i = 0; i < count; ++i)
    if (const Corner& c = corners[i]; c.held)
      depths[i] = offset + mixed(c, at[4 * i], at[4 * i + 1], at[4 * i + 2], at[4 * i + 3]);
  return depths;
}

}  // namespace palpate
