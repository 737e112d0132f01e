#include "viz/section.h"

#include <algorithm>
#include <cmath>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"

namespace palpate::viz {

void SectionLine::move(double dx, double dy) {
  dx = std::clamp(dx, -std::min(x0, x1), 1 - std::max(x0, x1));
  dy = std::clamp(dy, -std::min(y0, y1), 1 - std::max(y0, y1));
  x0 += dx, x1 += dx, y0 += dy, y1 += dy;
}

void SectionLine::turn(double angle_rad, double aspect) {
  const double middle_x = (x0 + x1) / 2, middle_y = (y0 + y1) / 2;
  const double u = (x1 - x0) / 2 * aspect, v = (y1 - y0) / 2;
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  double du = (c * u - s * v) / aspect, dv = s * u + c * v;
  // Shorter where it would leave the frame.
  double fit = 1;
  const auto keep = [&](double middle, double half) {
    const double room = std::min(middle, 1 - middle);
    if (std::abs(half) > room) fit = std::min(fit, room / std::abs(half));
  };
  keep(middle_x, du);
  keep(middle_y, dv);
  du *= fit, dv *= fit;
  x0 = middle_x - du, x1 = middle_x + du, y0 = middle_y - dv, y1 = middle_y + dv;
}

Profile::Extreme Profile::least() const {
  if (depth_mm.empty()) return {};
  const auto it = std::min_element(depth_mm.begin(), depth_mm.end());
  return {length_mm * static_cast<double>(it - depth_mm.begin()) / static_cast<double>(depth_mm.size() - 1),
          *it};
}

Profile::Extreme Profile::most() const {
  if (depth_mm.empty()) return {};
  const auto it = std::max_element(depth_mm.begin(), depth_mm.end());
  return {length_mm * static_cast<double>(it - depth_mm.begin()) / static_cast<double>(depth_mm.size() - 1),
          *it};
}

namespace {

/// The four texels around a sample, in the buffer; two and two are neighbours.
struct Corner {
  uint64_t top = 0, bottom = 0;  ///< place of the left texel, floats from the buffer's start
  float right = 0, down = 0;     ///< shares of the right and lower ones
  bool held = false;
};

float mixed(const Corner& c, float a, float b, float d, float e) {
  const float top = a + (b - a) * c.right, bottom = d + (e - d) * c.right;
  return top + (bottom - top) * c.down;
}

}  // namespace

Profile probe(gpu::Context& context, const SurfaceMap& map, double datum_mm, double pitch_mm_per_px,
              const SectionLine& line) {
  constexpr size_t kMostSamples = 1024;
  Profile profile;
  const double width = map.width - 1.0, height = map.height - 1.0;
  const double dx = (line.x1 - line.x0) * width, dy = (line.y1 - line.y0) * height;
  const double length_px = std::hypot(dx, dy);
  profile.length_mm = length_px * pitch_mm_per_px;
  const size_t count = std::clamp(static_cast<size_t>(std::ceil(length_px)) + 1, size_t{2}, kMostSamples);
  const PixelRect held = map.window.value_or(PixelRect{0, 0, map.width, map.height});
  std::vector<Corner> corners(count);
  for (size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count - 1);
    const double x = std::clamp(line.x0 * width + t * dx, 0.0, width);
    const double y = std::clamp(line.y0 * height + t * dy, 0.0, height);
    // The right neighbour always exists: at the edge the share of it is 1. A map of one column has none.
    const double left = std::clamp(std::floor(x), 0.0, std::max(0.0, width - 1));
    const double above = std::clamp(std::floor(y), 0.0, std::max(0.0, height - 1));
    const auto px = static_cast<int64_t>(left) - held.x, py = static_cast<int64_t>(above) - held.y;
    Corner& c = corners[i];
    c.held = px >= 0 && py >= 0 && px + 1 < held.width && py + 1 < held.height;
    if (!c.held) continue;
    c.top = static_cast<uint64_t>(py) * map.pitch + static_cast<uint64_t>(px);
    c.bottom = c.top + map.pitch;
    c.right = static_cast<float>(x - left);
    c.down = static_cast<float>(y - above);
  }
  profile.depth_mm.assign(count, 0.0f);
  const auto datum = static_cast<float>(datum_mm);
  if (map.buffer->mapped()) {
    map.buffer->invalidate();
    const auto at = map.buffer->as<float>();
    for (size_t i = 0; i < count; ++i)
      if (const Corner& c = corners[i]; c.held)
        profile.depth_mm[i] = datum + mixed(c, at[c.top], at[c.top + 1], at[c.bottom], at[c.bottom + 1]);
    return profile;
  }
  gpu::DeviceBuffer copies(context, "section", count * 4 * sizeof(float), gpu::Memory::Readback);
  std::vector<VkBufferCopy> regions;
  for (size_t i = 0; i < count; ++i) {
    if (!corners[i].held) continue;
    constexpr uint64_t kPair = 2 * sizeof(float);
    regions.push_back({corners[i].top * sizeof(float), i * 2 * kPair, kPair});
    regions.push_back({corners[i].bottom * sizeof(float), i * 2 * kPair + kPair, kPair});
  }
  if (regions.empty()) return profile;
  gpu::Commands commands(context);
  commands.begin();
  vkCmdCopyBuffer(commands.handle(), map.buffer->handle(), copies.handle(),
                  static_cast<uint32_t>(regions.size()), regions.data());
  commands.host_barrier();
  commands.end();
  commands.submit();
  commands.wait();
  copies.invalidate();
  const auto at = copies.as<float>();
  for (size_t i = 0; i < count; ++i)
    if (const Corner& c = corners[i]; c.held)
      profile.depth_mm[i] = datum + mixed(c, at[4 * i], at[4 * i + 1], at[4 * i + 2], at[4 * i + 3]);
  return profile;
}

}  // namespace palpate::viz
