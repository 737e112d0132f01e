#include "engine/measure/contact/contact_shape.h"

#include <algorithm>
#include <cmath>

#include "engine/base/numbers.h"

namespace palpate {
namespace {

Ellipse ellipse_of(const ContactMoments& m, double pitch_mm) {
  // Central second moments of the area; 1/12 is a single pixel's own.
  const double n = static_cast<double>(m.area);
  const double mx = static_cast<double>(m.x) / n, my = static_cast<double>(m.y) / n;
  const double xx = static_cast<double>(m.xx) / n - mx * mx + 1.0 / 12;
  const double yy = static_cast<double>(m.yy) / n - my * my + 1.0 / 12;
  const double xy = static_cast<double>(m.xy) / n - mx * my;
  const double middle = (xx + yy) / 2, half = std::hypot((xx - yy) / 2, xy);
  // A filled ellipse of semi-axis s has the second moment s^2 / 4 along it.
  const double major_px = 4 * std::sqrt(middle + half),
               minor_px = 4 * std::sqrt(std::max(middle - half, 0.0));
  return {major_px * pitch_mm, minor_px * pitch_mm, std::atan2(2 * xy, xx - yy) / 2, major_px, minor_px};
}

}  // namespace

void set_shape(ContactTouch& shape, const ContactMoments& m, const ShapeScale& scale) {
  shape.gray_sum = static_cast<double>(m.gray) / 256;
  shape.area_px = m.area;
  shape.area_mm2 = static_cast<double>(m.area) * scale.pitch_mm_per_px * scale.pitch_mm_per_px;
  shape.peak_gray = m.peak / 256.0;
  shape.saturated_px = m.saturated;
  shape.at_border = m.border;
  shape.centroid_x_px = shape.centroid_y_px = kNaN;
  if (m.area == 0) return;
  // A threshold of 0 lets pixels without any gray count as contact; their centroid is the area's.
  const bool weighted = m.gray > 0;
  const double weight = static_cast<double>(weighted ? m.gray : m.area);
  shape.centroid_x_px = scale.center_x_px + static_cast<double>(weighted ? m.gray_x : m.x) / weight;
  shape.centroid_y_px = scale.center_y_px + static_cast<double>(weighted ? m.gray_y : m.y) / weight;
  shape.ellipse = ellipse_of(m, scale.pitch_mm_per_px);
}

}  // namespace palpate
