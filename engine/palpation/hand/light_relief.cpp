#include "engine/palpation/hand/light_relief.h"

#include <algorithm>
#include <cmath>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"

namespace palpate {
namespace {

constexpr double kLeastPitch_mm = 0.12;
constexpr double kAround_mm = 4, kNear_mm = 0.6;
constexpr float kTouched = 0.3f;  // of the median
constexpr double kHeight_mm = 0.1;

/// Means of what was seen within squares around each node; 0 where nothing was.
std::vector<float> box_means(const PressureMap& map, double side_mm) {
  const uint32_t w = map.width, h = map.height;
  const auto reach = static_cast<uint32_t>(side_mm / (2 * map.pitch_mm[0]));
  // Sums from the first node on, each row and column one longer.
  std::vector<double> sum(size_t{w + 1} * (h + 1), 0), count(sum.size(), 0);
  const auto at = [w](uint32_t x, uint32_t y) { return size_t{y} * (w + 1) + x; };
  for (uint32_t y = 0; y < h; ++y)
    for (uint32_t x = 0; x < w; ++x) {
      const float value = map.at(x, y);
      const bool seen = std::isfinite(value);
      const auto add = [&](std::vector<double>& to, double what) {
        to[at(x + 1, y + 1)] = what + to[at(x, y + 1)] + to[at(x + 1, y)] - to[at(x, y)];
      };
      add(sum, seen ? double{value} : 0);
      add(count, seen ? 1 : 0);
    }
  std::vector<float> means(size_t{w} * h);
  for (uint32_t y = 0; y < h; ++y)
    for (uint32_t x = 0; x < w; ++x) {
      const uint32_t x0 = x - std::min(x, reach), x1 = std::min(w, x + reach + 1);
      const uint32_t y0 = y - std::min(y, reach), y1 = std::min(h, y + reach + 1);
      const auto within = [&](const std::vector<double>& of) {
        return of[at(x1, y1)] - of[at(x0, y1)] - of[at(x1, y0)] + of[at(x0, y0)];
      };
      const double seen = within(count);
      means[size_t{y} * w + x] = seen > 0 ? static_cast<float>(within(sum) / seen) : 0.0f;
    }
  return means;
}

float touched_Pa(const PressureMap& map) {
  std::vector<double> seen;
  for (const float value : map.values)
    if (std::isfinite(value)) seen.push_back(double{value});
  return seen.empty() ? 0 : kTouched * static_cast<float>(median(seen));
}

}  // namespace

double relief_pitch_mm(double pixel_mm) {
  return pixel_mm * std::max(1.0, std::ceil(kLeastPitch_mm / pixel_mm));
}

SkinRelief relief_of_pressure(const PressureMap& map, double force_N) {
  SkinRelief relief{map.width, map.height, map.pitch_mm[0], {}, {}, force_N};
  const std::vector<float> around = box_means(map, kAround_mm), near = box_means(map, kNear_mm);
  const float least_Pa = touched_Pa(map);
  for (size_t i = 0; i < map.values.size(); ++i) {
    const bool touches = std::isfinite(map.values[i]) && least_Pa > 0 && near[i] >= least_Pa;
    relief.contact.push_back(touches ? 1 : 0);
    relief.depth_mm.push_back(touches ? static_cast<float>(kHeight_mm) * (map.values[i] / around[i] - 1)
                                      : 0.0f);
  }
  return relief;
}

void hide_untouched(PressureMap& map) {
  const float least_Pa = touched_Pa(map);
  const std::vector<float> value = map.values;
  for (uint32_t j = 0; j < map.height; ++j)
    for (uint32_t i = 0; i < map.width; ++i) {
      if (value[size_t{j} * map.width + i] >= least_Pa) continue;
      for (uint32_t y = j - std::min(j, 1u); y <= std::min(j + 1, map.height - 1); ++y)
        for (uint32_t x = i - std::min(i, 1u); x <= std::min(i + 1, map.width - 1); ++x)
          map.values[size_t{y} * map.width + x] = static_cast<float>(kNaN);
    }
}

}  // namespace palpate
