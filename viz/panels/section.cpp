#include "viz/panels/section.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/pipeline/surface_sample.h"

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

Profile probe(gpu::Context& context, const SurfaceMap& map, double datum_mm, double pitch_mm_per_px,
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
  profile.depth_mm = sample_depths(context, map, datum_mm, places);
  return profile;
}

}  // namespace palpate::viz
