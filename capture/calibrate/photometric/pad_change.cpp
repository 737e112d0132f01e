#include "capture/calibrate/photometric/pad_change.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/calibrate/background.h"
#include "capture/calibrate/frame/markers.h"
#include "capture/calibrate/untouched_recording.h"
#include "engine/base/statistics.h"
#include "engine/measure/picture/light_change.h"
#include "engine/measure/picture/picture_check.h"

namespace palpate {
namespace {

constexpr uint32_t kCell = 8;       // px
constexpr double kDark_gray = 25;   // a change of darker levels is relative to this
constexpr double kElsewhere = 0.9;  // of the cells change by less

/// Means of cells of each colour, gray levels of 8 bits.
std::vector<std::vector<float>> cells_of(const Frame& frame) {
  const FrameFormat& f = frame.format;
  const float scale = 255.0f / (static_cast<float>(f.max_gray()) * kCell * kCell);
  std::vector<std::vector<float>> cells(f.channels);
  for (uint32_t c = 0; c < f.channels; ++c)
    for (uint32_t y = 0; y + kCell <= f.height; y += kCell)
      for (uint32_t x = 0; x + kCell <= f.width; x += kCell) {
        uint64_t sum = 0;
        for (uint32_t v = 0; v < kCell; ++v)
          for (uint32_t u = 0; u < kCell; ++u) sum += frame.at(c, x + u, y + v);
        cells[c].push_back(static_cast<float>(sum) * scale);
      }
  return cells;
}

/// Cells of a colour in both pictures that carry information, and the light between them.
struct Colour {
  std::vector<float> before, change;
  LightChange light;

  Colour(const std::vector<float>& was, const std::vector<float>& is, float dead) {
    for (size_t i = 0; i < was.size(); ++i) {
      if (was[i] >= dead || is[i] >= dead) continue;
      before.push_back(was[i]);
      change.push_back(is[i] - was[i]);
    }
    if (before.empty())
      light = {.known = false, .share = 0};
    else
      light = LightEstimate(before.size()).find(change, before);
  }
};

std::vector<Colour> colours_of(const Frame& calibrated, const Frame& now, const Sensor& sensor) {
  const auto was = cells_of(calibrated), is = cells_of(now);
  const float dead =
      255.0f * static_cast<float>(dead_gray(sensor)) / static_cast<float>(calibrated.format.max_gray());
  std::vector<Colour> colours;
  for (size_t c = 0; c < was.size(); ++c) colours.emplace_back(was[c], is[c], dead);
  return colours;
}

}  // namespace

PadLight light_between(const Frame& calibrated, const Frame& now, const Sensor& sensor) {
  PadLight light{.share = 1};
  const std::vector<Colour> colours = colours_of(calibrated, now, sensor);
  for (size_t c = 0; c < colours.size(); ++c) {
    const Colour& colour = colours[c];
    double level = 0;
    for (const float gray : colour.before) level += double{gray};
    level /= static_cast<double>(std::max<size_t>(colour.before.size(), 1));
    light.change[c] = colour.light.at(level) / std::max(level, kDark_gray);
    light.brightness += light.change[c] / static_cast<double>(colours.size());
    light.share = std::min(light.share, colour.light.share);
  }
  for (size_t c = 0; c < colours.size(); ++c)
    light.colour = std::max(light.colour, std::abs(light.change[c] - light.brightness));
  return light;
}

PadLight light_of(const std::vector<PadLight>& lights) {
  const auto middle = [&](auto value) {
    std::vector<double> values;
    for (const PadLight& light : lights) values.push_back(value(light));
    return median_in_place(values);
  };
  PadLight all;
  for (size_t c = 0; c < all.change.size(); ++c)
    all.change[c] = middle([c](const PadLight& l) { return l.change[c]; });
  all.brightness = middle([](const PadLight& l) { return l.brightness; });
  all.colour = middle([](const PadLight& l) { return l.colour; });
  for (const PadLight& light : lights) all.share = std::max(all.share, light.share);
  return all;
}

PadPattern pattern_between(const Frame& calibrated, const Frame& now, const Sensor& sensor) {
  PadPattern pattern;
  for (const Colour& colour : colours_of(calibrated, now, sensor)) {
    if (colour.before.empty()) continue;
    std::vector<double> left;
    for (size_t i = 0; i < colour.before.size(); ++i)
      left.push_back(std::abs(double{colour.change[i]} - colour.light.at(double{colour.before[i]})));
    pattern.elsewhere_gray = std::max(pattern.elsewhere_gray, quantile_in_place(left, kElsewhere));
  }
  pattern.specks_px =
      evident_touch_px(now, calibrated, clear_threshold(sensor.threshold_gray, calibrated.format));
  if (sensor.skin && sensor.skin->kind == SkinKind::Markers) {
    const std::optional<SkinPattern> before = marker_pattern(calibrated, sensor),
                                     after = marker_pattern(now, sensor);
    if (before && after) pattern.marker_scale = after->spacing_px / before->spacing_px;
  }
  PictureCheck check(calibrated.format, sensor.saturation_gray, sensor.pad);
  check.set_reference(calibrated);
  pattern.fault = check.look_at(now);
  return pattern;
}

}  // namespace palpate
