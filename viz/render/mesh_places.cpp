#include "viz/render/mesh_places.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate::viz {

std::vector<float> mesh_places(uint32_t texels, uint32_t count, double from, double to) {
  constexpr double kShare = 0.7;  // of the vertices, within the span
  std::vector<float> places(count);
  const double last = std::max(texels, 1u) - 1.0;
  const auto cells = static_cast<int>(count) - 1;
  const auto spread = [&](int first, int behind, double a, double b) {
    for (int i = first; i <= behind; ++i)
      places[static_cast<size_t>(i)] =
          static_cast<float>(a + (b - a) * (i - first) / std::max(behind - first, 1));
  };
  from = std::clamp(from, 0.0, last);
  to = std::clamp(to, from, last);
  const double inner = to - from, outer = last - inner;
  const auto within = static_cast<int>(std::min(std::ceil(inner), std::floor(kShare * cells)));
  const int around = cells - within;
  const int sides = (from > 0) + (to < last);
  if (within < 1 || around < sides || sides == 0 || inner / within >= last / cells) {
    spread(0, cells, 0, last);
    return places;
  }
  int before = static_cast<int>(std::lround(around * from / outer));
  if (from > 0) before = std::max(before, 1);
  if (to < last) before = std::min(before, around - 1);
  spread(0, before, 0, from);
  spread(before + within, cells, to, last);
  spread(before, before + within, from, to);
  return places;
}

std::optional<PixelRect> dented_part(const Touch& touch, uint32_t width, uint32_t height) {
  constexpr double kMargin = 0.25;
  if (!touch.contact) return std::nullopt;
  constexpr double kFar = std::numeric_limits<double>::max();
  double left = kFar, top = kFar, right = -kFar, bottom = -kFar;
  const auto take = [&](double x, double y, double half_x, double half_y) {
    if (!std::isfinite(x + y + half_x + half_y)) return;
    left = std::min(left, x - half_x);
    right = std::max(right, x + half_x);
    top = std::min(top, y - half_y);
    bottom = std::max(bottom, y + half_y);
  };
  for (const ContactTouch& c : touch.contacts)
    take(c.box.x + 0.5 * c.box.width, c.box.y + 0.5 * c.box.height, (0.5 + kMargin) * c.box.width,
         (0.5 + kMargin) * c.box.height);
  if (touch.contacts.empty()) {
    const double half = (0.5 + kMargin) * touch.ellipse.major_px;
    take(touch.centroid_x_px, touch.centroid_y_px, half, half);
  }
  left = std::max(left, 0.0);
  top = std::max(top, 0.0);
  right = std::min(right, static_cast<double>(width));
  bottom = std::min(bottom, static_cast<double>(height));
  if (right <= left || bottom <= top) return std::nullopt;
  return PixelRect{static_cast<uint32_t>(left), static_cast<uint32_t>(top),
                   static_cast<uint32_t>(std::ceil(right - left)),
                   static_cast<uint32_t>(std::ceil(bottom - top))};
}

}  // namespace palpate::viz
