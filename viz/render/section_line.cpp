#include "viz/render/section_line.h"

#include <algorithm>
#include <cmath>

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

}  // namespace palpate::viz
