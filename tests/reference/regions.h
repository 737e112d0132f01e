// The regions stage in its plainest form: flood fill from each pixel that has no region yet.
#pragma once

#include <algorithm>
#include <vector>

#include "engine/stages/frame/regions.h"
#include "tests/reference/contact.h"

namespace palpate::reference {

/// Connected regions (8 neighbours) of the contact pixels, in reading order of their first pixels.
inline std::vector<Region> regions(const Frame& image, const Frame& rest, const Sensor& sensor) {
  const auto threshold = static_cast<uint32_t>(std::lround(sensor.threshold_gray * 128)) * 2;
  const std::vector<uint32_t> filtered = filtered_change(image, rest, sensor.signal, sensor.filter);
  const uint32_t width = image.format.width, height = image.format.height;
  std::vector<char> open(filtered.size());
  for (size_t i = 0; i < filtered.size(); ++i) open[i] = filtered[i] >= threshold;
  std::vector<Region> regions;
  std::vector<std::pair<uint32_t, uint32_t>> edge;
  for (uint32_t y0 = 0; y0 < height; ++y0) {
    for (uint32_t x0 = 0; x0 < width; ++x0) {
      if (!open[size_t{y0} * width + x0]) continue;
      Region region;
      uint32_t left = x0, right = x0, bottom = y0;
      open[size_t{y0} * width + x0] = 0;
      edge.assign(1, {x0, y0});
      while (!edge.empty()) {
        const auto [x, y] = edge.back();
        edge.pop_back();
        ContactMoments& m = region.moments;
        m.saturated += is_saturated(image, rest, sensor, x, y);
        add_pixel(m, x, y, filtered[size_t{y} * width + x], width, height);
        left = std::min(left, x);
        right = std::max(right, x);
        bottom = std::max(bottom, y);
        for (uint32_t v = y - std::min(y, 1u); v <= std::min(y + 1, height - 1); ++v) {
          for (uint32_t u = x - std::min(x, 1u); u <= std::min(x + 1, width - 1); ++u) {
            char& there = open[size_t{v} * width + u];
            if (there) edge.emplace_back(u, v);
            there = 0;
          }
        }
      }
      region.box = {left, y0, right - left + 1, bottom - y0 + 1};
      regions.push_back(region);
    }
  }
  return regions;
}

}  // namespace palpate::reference
