#include "viz/panels/section.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/pipeline/surface/surface_sample.h"

namespace palpate::viz {

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

Profile probe(gpu::Context& context, const SurfaceMap& map, double offset_mm, double pitch_mm_per_px,
              const SectionLine& line) {
  constexpr size_t kMostSamples = 1024;
  Profile profile;
  const double width = map.width - 1.0, height = map.height - 1.0;
  const double dx = (line.x1 - line.x0) * width, dy = (line.y1 - line.y0) * height;
  const double length_px = std::hypot(dx, dy);
  profile.length_mm = length_px * pitch_mm_per_px;
  const size_t count = std::clamp(static_cast<size_t>(std::ceil(length_px)) + 1, size_t{2}, kMostSamples);
  std::vector<std::array<double, 2>> places(count);
  for (size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count - 1);
    places[i] = {line.x0 * width + t * dx, line.y0 * height + t * dy};
  }
  profile.depth_mm = sample_depths(context, map, offset_mm, places);
  return profile;
}

}  // namespace palpate::viz
