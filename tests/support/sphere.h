// Discs of depth maps against spheres.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate {

/// RMS of what a sphere leaves of a disc of a depth map, with tilt and offset free; mm. Places are about the
/// sphere's centre.
inline double sphere_error_mm(const std::vector<double>& depth,
                              const std::vector<std::array<double, 2>>& at_mm, double radius_mm) {
  double n = 0, s0 = 0, sx = 0, sy = 0, mx = 0, my = 0, xx = 0, yy = 0, xy = 0, ss = 0;
  for (const auto& p : at_mm) mx += p[0], my += p[1];
  mx /= static_cast<double>(at_mm.size()), my /= static_cast<double>(at_mm.size());
  for (size_t i = 0; i < depth.size(); ++i) {
    const double x = at_mm[i][0] - mx, y = at_mm[i][1] - my;
    const double r2 = at_mm[i][0] * at_mm[i][0] + at_mm[i][1] * at_mm[i][1];
    const double e = depth[i] - (std::sqrt(radius_mm * radius_mm - r2) - radius_mm);
    n += 1, s0 += e, sx += e * x, sy += e * y, xx += x * x, yy += y * y, xy += x * y, ss += e * e;
  }
  const double det = xx * yy - xy * xy;
  const double a = (sx * yy - sy * xy) / det, b = (sy * xx - sx * xy) / det;
  return std::sqrt(std::max(0.0, ss - s0 * s0 / n - a * sx - b * sy) / n);
}

/// Radius of the sphere that leaves least.
inline double sphere_radius_mm(const std::vector<double>& depth,
                               const std::vector<std::array<double, 2>>& at_mm) {
  double best = 0, least = 1e300, reach = 0;
  for (const auto& p : at_mm) reach = std::max(reach, std::hypot(p[0], p[1]));
  for (double radius = 1.02 * reach; radius < 40; radius *= 1.003)
    if (const double left = sphere_error_mm(depth, at_mm, radius); left < least) least = left, best = radius;
  return best;
}

}  // namespace palpate
