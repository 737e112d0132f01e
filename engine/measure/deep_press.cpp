#include "engine/measure/deep_press.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kNarrowest = 0.25, kWidest = 3;  // radii that were computed

/// ln(factor) of one kind of object: d (even + narrow / a) + d^3 (deep + deep_narrow / a).
struct Kind {
  double even, narrow, deep, deep_narrow;
  double at(double depth, double radius) const {
    return depth * (even + narrow / radius) + std::pow(depth, 3) * (deep + deep_narrow / radius);
  }
};

// Fits to perf/results/lavapipe-22.3.6-2-cores/traction/deep_presses.csv, whose spheres they hold to 1.5 %
// and cylinders to 2.3 %. Half of what a flat face departs from spheres is the standard error of them all.
constexpr Kind kSphere{0.048, -0.100, 0.582, -0.690}, kCylinder{0.064, 0.095, 0.723, 0.200};
constexpr double kFlat = 0.12, kFlatDeep = 0.75;

}  // namespace

PressShape press_shape(std::span<const float> pressure, const TractionGrid& grid, double depth_mm,
                       double thickness_mm) {
  double sum = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (size_t i = 0; i < pressure.size(); ++i) {
    if (!(pressure[i] > 0)) continue;
    const double p = double{pressure[i]};
    const size_t line = i / grid.width;
    const auto column = static_cast<double>(i % grid.width), row = static_cast<double>(line);
    sum += p, x += p * column, y += p * row;
    xx += p * column * column, xy += p * column * row, yy += p * row * row;
  }
  PressShape shape{.depth = depth_mm > 0 ? depth_mm / thickness_mm : 0};
  if (!(sum > 0)) return shape;
  x /= sum, y /= sum;
  xx = xx / sum - x * x, xy = xy / sum - x * y, yy = yy / sum - y * y;
  const double middle = 0.5 * (xx + yy), apart = std::hypot(0.5 * (xx - yy), xy);
  const double narrow = std::sqrt(std::max(middle - apart, 0.0)), along = std::sqrt(middle + apart);
  shape.radius = std::sqrt(5.0) * narrow * grid.cell_mm / thickness_mm;  // as pressure under a sphere spreads
  if (along > 0) shape.round = narrow / along;
  return shape;
}

DeepPress deep_press(const PressShape& press) {
  const double depth = std::clamp(press.depth, 0.0, kDeepestPress);
  const double radius = std::clamp(press.radius, kNarrowest, kWidest);
  const double sphere = kSphere.at(depth, radius), cylinder = kCylinder.at(depth, radius);
  const double flat_sd = depth * (kFlat + kFlatDeep * depth * depth);
  const double between_sd = std::sqrt(press.round * (1 - press.round)) * (cylinder - sphere);
  return {.factor = std::exp(press.round * sphere + (1 - press.round) * cylinder),
          .relative_sd = std::hypot(flat_sd, between_sd)};
}

}  // namespace palpate
