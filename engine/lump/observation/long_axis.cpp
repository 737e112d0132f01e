#include "engine/lump/observation/long_axis.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "engine/base/statistics.h"

namespace palpate::lump {
namespace {

constexpr double kReach_mm = 12;  // around a bump

}  // namespace

bool longer_along_y(const Observation& observation, double x_mm, double y_mm) {
  const PressureMap& map = observation.pressure_Pa.back();
  std::vector<float> seen;
  std::copy_if(map.values.begin(), map.values.end(), std::back_inserter(seen),
               [](float p) { return std::isfinite(p); });
  if (seen.empty()) return false;
  const auto level = double{median(std::move(seen))};
  const auto each = [&](const auto& take) {
    for (uint32_t row = 0; row < map.height; ++row)
      for (uint32_t column = 0; column < map.width; ++column) {
        const double x = observation.window_mm[0] + (column - (map.width - 1) / 2.0) * map.pitch_mm[0] - x_mm;
        const double y = observation.window_mm[1] + (row - (map.height - 1) / 2.0) * map.pitch_mm[1] - y_mm;
        const auto value = double{map.at(column, row)};
        if (std::isfinite(value) && x * x + y * y <= kReach_mm * kReach_mm) take(x, y, value);
      }
  };
  // Nodes that stand out less than half as high as the top belong to the block as much as to the lump.
  double top = level;
  each([&](double, double, double value) { top = std::max(top, value); });
  double along_x = 0, along_y = 0;
  each([&](double x, double y, double value) {
    const double above = std::max(0.0, value - (level + top) / 2);
    along_x += above * x * x;
    along_y += above * y * y;
  });
  return along_y > along_x;
}

}  // namespace palpate::lump
