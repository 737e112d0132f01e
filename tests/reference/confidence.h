// Confidence of each pixel, in plain loops.
#pragma once

#include <algorithm>
#include <vector>

#include "engine/sensor/outline.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate::reference {

struct Known {
  uint32_t confidence = 0;  ///< 0 to 255
  bool saturated = false, shadowed = false, outside = false;
};

/// height x width.
inline std::vector<Known> confidence(const Frame& image, const Frame& rest, const Sensor& sensor) {
  const int width = static_cast<int>(image.format.width), height = static_cast<int>(image.format.height);
  const int reach =
      sensor.reading == SurfaceReading::Shading || sensor.reading == SurfaceReading::Elastic ? 2 : 0;
  const uint32_t shadow = shadow_gray(sensor);
  const auto brightest = [](const Frame& frame, int x, int y) {
    uint32_t value = 0;
    for (uint32_t c = 0; c < frame.format.channels; ++c)
      value = std::max(value, frame.at(c, static_cast<uint32_t>(x), static_cast<uint32_t>(y)));
    return value;
  };
  std::vector<Known> out;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Known k;
      for (int v = std::max(y - reach, 0); v <= std::min(y + reach, height - 1); ++v)
        for (int u = std::max(x - reach, 0); u <= std::min(x + reach, width - 1); ++u)
          if (std::max(brightest(image, u, v), brightest(rest, u, v)) >= sensor.saturation_gray)
            k.saturated = true;
      k.outside = sensor.pad && !contains(*sensor.pad, x, y);
      const uint32_t darkest = std::min(brightest(image, x, y), brightest(rest, x, y));
      k.shadowed = shadow > 0 && darkest < 2 * shadow;
      k.confidence = k.saturated || k.outside ? 0
                     : !k.shadowed            ? 255
                     : darkest <= shadow      ? 0
                                              : (darkest - shadow) * 255 / shadow;
      out.push_back(k);
    }
  }
  return out;
}

}  // namespace palpate::reference
