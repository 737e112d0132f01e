// The contact stage in its plainest form: plain loops, one pixel at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/stages/frame/contact.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate::reference {

/// Change from the background: the sensor's signal, the largest of the channels.
inline uint32_t change_at(const Frame& image, const Frame& rest, Signal signal, uint32_t x, uint32_t y) {
  uint32_t largest = 0;
  for (uint32_t channel = 0; channel < image.format.channels; ++channel) {
    const int64_t d = int64_t{image.at(channel, x, y)} - int64_t{rest.at(channel, x, y)};
    const int64_t g = signal == Signal::Brighter ? d : signal == Signal::Darker ? -d : std::abs(d);
    largest = std::max(largest, static_cast<uint32_t>(std::max<int64_t>(g, 0)));
  }
  return largest;
}

/// 5x5 binomial filter of the change, edges repeated, in 1/256 gray levels; height x width. Filter::None: the
/// change itself in the same unit.
inline std::vector<uint32_t> filtered_change(const Frame& image, const Frame& rest, Signal signal,
                                             Filter filter = Filter::Binomial5) {
  constexpr uint32_t kWeights[5] = {1, 4, 6, 4, 1};
  const int width = static_cast<int>(image.format.width), height = static_cast<int>(image.format.height);
  std::vector<uint32_t> change, out;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      change.push_back(change_at(image, rest, signal, static_cast<uint32_t>(x), static_cast<uint32_t>(y)));
  if (filter == Filter::None) {
    for (uint32_t& value : change) value *= 256;
    return change;
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      uint32_t sum = 0;
      for (int j = -2; j <= 2; ++j)
        for (int i = -2; i <= 2; ++i)
          sum += kWeights[j + 2] * kWeights[i + 2] *
                 change[static_cast<size_t>(std::clamp(y + j, 0, height - 1) * width +
                                            std::clamp(x + i, 0, width - 1))];
      out.push_back(sum);
    }
  }
  return out;
}

/// One contact pixel of filtered value g more.
inline void add_pixel(ContactMoments& m, uint32_t x, uint32_t y, uint32_t g, uint32_t width,
                      uint32_t height) {
  const int64_t cx = int64_t{x} - width / 2, cy = int64_t{y} - height / 2;
  m.border = m.border || x == 0 || y == 0 || x + 1 == width || y + 1 == height;
  m.area += 1;
  m.gray += g;
  m.gray_x += cx * g;
  m.gray_y += cy * g;
  m.x += cx;
  m.y += cy;
  m.xx += cx * cx;
  m.xy += cx * cy;
  m.yy += cy * cy;
  m.peak = std::max(m.peak, g);
}

inline uint32_t brightest(const Frame& image, uint32_t x, uint32_t y) {
  uint32_t gray = 0;
  for (uint32_t channel = 0; channel < image.format.channels; ++channel)
    gray = std::max(gray, image.at(channel, x, y));
  return gray;
}

/// The brightest channel of a raw pixel is at the sensor's limit, and was not nearly there untouched.
inline bool is_saturated(const Frame& image, const Frame& rest, const Sensor& sensor, uint32_t x,
                         uint32_t y) {
  return brightest(image, x, y) >= sensor.saturation_gray &&
         (sensor.background.kind == BackgroundKind::None || brightest(rest, x, y) < dead_gray(sensor));
}

/// With BackgroundKind::None `rest` must be black.
inline ContactMoments moments(const Frame& image, const Frame& rest, const Sensor& sensor) {
  const auto threshold = static_cast<uint32_t>(std::lround(sensor.threshold_gray * 128)) * 2;
  const std::vector<uint32_t> filtered = filtered_change(image, rest, sensor.signal, sensor.filter);
  const uint32_t width = image.format.width, height = image.format.height;
  ContactMoments m;
  for (uint32_t y = 0; y < height; ++y) {
    for (uint32_t x = 0; x < width; ++x) {
      m.saturated += is_saturated(image, rest, sensor, x, y);
      const uint32_t g = filtered[size_t{y} * width + x];
      if (g < threshold) continue;
      add_pixel(m, x, y, g, width, height);
    }
  }
  return m;
}

}  // namespace palpate::reference
