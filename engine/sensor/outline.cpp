#include "engine/sensor/outline.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

bool inside(const PadRectangle& r, double x, double y) {
  return x >= r.x && x <= r.x + r.width - 1 && y >= r.y && y <= r.y + r.height - 1;
}

bool inside(const PadEllipse& e, double x, double y) {
  const double c = std::cos(e.angle_rad), s = std::sin(e.angle_rad), dx = x - e.x, dy = y - e.y;
  const double u = (c * dx + s * dy) / e.radius_x, v = (c * dy - s * dx) / e.radius_y;
  return u * u + v * v <= 1;
}

bool inside(const PadPolygon& polygon, double x, double y) {
  bool odd = false;
  const auto& corners = polygon.corners;
  for (size_t i = 0, before = corners.size() - 1; i < corners.size(); before = i++) {
    const auto& [ax, ay] = corners[before];
    const auto& [bx, by] = corners[i];
    const double cross = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
    if (cross == 0 && x >= std::min(ax, bx) && x <= std::max(ax, bx) && y >= std::min(ay, by) &&
        y <= std::max(ay, by))
      return true;
    if ((ay > y) != (by > y) && x < ax + (bx - ax) * (y - ay) / (by - ay)) odd = !odd;
  }
  return odd;
}

}  // namespace

bool contains(const PadOutline& outline, double x_px, double y_px) {
  return std::visit([&](const auto& shape) { return inside(shape, x_px, y_px); }, outline);
}

}  // namespace palpate
