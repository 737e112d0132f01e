#include "engine/sensor/lookup_depth.h"

#include <algorithm>

namespace palpate {

double lookup_depth_mm(const LookupCalibration& lookup, double gray) {
  const auto& points = lookup.points;
  if (points.empty() || gray <= points.front()[0]) return 0;
  if (gray >= points.back()[0]) return points.back()[1];
  const auto next = std::upper_bound(points.begin(), points.end(), gray,
                                     [](double value, const auto& point) { return value < point[0]; });
  const auto& [gray1, depth1] = *next;
  const auto& [gray0, depth0] = *(next - 1);
  return depth0 + (depth1 - depth0) * (gray - gray0) / (gray1 - gray0);
}

}  // namespace palpate
