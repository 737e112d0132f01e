#include "engine/tissue/map_sampling.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
MapTaps map_taps(double place, uint32_t nodes) {
  const double i = std::clamp(place, 0.0, nodes - 1.0);
  const uint32_t cell = std::min(static_cast<uint32_t>(i), nodes - 2);
  const uint32_t half = std::min({3u, cell + 1, nodes - 1 - cell});
  // For each node, one over the product of its signed distances from the others.
  static constexpr std::array<std::array<double, 6>, 3> kFraction = {
      {{-1, 1},
       {-1. / 6, 1. / 2, -1. / 2, 1. / 6},
       {-1. / 120, 1. / 24, -1. / 12, 1. / 12, -1. / 24, 1. / 120}}};
  MapTaps taps{cell + 1 - half, 2 * half, kFraction[half - 1]};
  const double from_first = i - taps.first;
  double before = 1, after = 1;
  for (uint32_t k = 0; k < taps.count; ++k) {
    const uint32_t last = taps.count - 1 - k;
    taps.weight[k] *= before;
    taps.weight[last] *= after;
    before *= from_first - k;
    after *= from_first - last;
  }
  return taps;
}

double map_at(const PressureMap& map, double x_mm, double y_mm) {
  const MapTaps x = map_taps(x_mm / map.pitch_mm[0] + (map.width - 1) / 2.0, map.width),
                y = map_taps(y_mm / map.pitch_mm[1] + (map.height - 1) / 2.0, map.height);
  double sum = 0;
  for (uint32_t j = 0; j < y.count; ++j) {
    if (y.weight[j] == 0) continue;
    double row = 0;
    for (uint32_t i = 0; i < x.count; ++i)
      if (x.weight[i] != 0) row += x.weight[i] * static_cast<double>(map.at(x.first + i, y.first + j));
    sum += y.weight[j] * row;
  }
  return sum;
}

MapRows::MapRows(const PressureMap& map, std::span<const double> x_mm) : map_(map), at_row_(map.width) {
  taps_.reserve(x_mm.size());
  for (const double x : x_mm)
    taps_.push_back(map_taps(x / map.pitch_mm[0] + (map.width - 1) / 2.0, map.width));
}

void MapRows::read(double y_mm, std::span<double> out) {
  const MapTaps y = map_taps(y_mm / map_.pitch_mm[1] + (map_.height - 1) / 2.0, map_.height);
  std::fill(at_row_.begin(), at_row_.end(), 0.0);
  for (uint32_t j = 0; j < y.count; ++j) {
    if (y.weight[j] == 0) continue;
    const float* row = map_.values.data() + size_t{y.first + j} * map_.width;
    for (uint32_t i = 0; i < map_.width; ++i) at_row_[i] += y.weight[j] * static_cast<double>(row[i]);
  }
  for (size_t column = 0; column < taps_.size(); ++column) {
    const MapTaps& x = taps_[column];
    double sum = 0;
    for (uint32_t i = 0; i < x.count; ++i)
      if (x.weight[i] != 0) sum += x.weight[i] * at_row_[x.first + i];
    out[column] = sum;
  }
}

uint32_t window_nodes(double window_mm, double pitch_mm) {
  return 2 * static_cast<uint32_t>(std::max(0.0, std::floor((window_mm / pitch_mm - 1) / 2 + 1e-9))) + 1;
}

PressureMap node_means(const PressureMap& map, std::array<double, 2> center_mm,
                       std::array<double, 2> window_mm, double pitch_mm, uint32_t samples) {
  PressureMap out;
  out.width = window_nodes(window_mm[0], pitch_mm);
  out.height = window_nodes(window_mm[1], pitch_mm);
  out.pitch_mm = {pitch_mm, pitch_mm};
  out.values.resize(size_t{out.width} * out.height);
  const double reach_x = map.pitch_mm[0] * (map.width - 1) / 2 + 1e-9,
               reach_y = map.pitch_mm[1] * (map.height - 1) / 2 + 1e-9;
  for (uint32_t j = 0; j < out.height; ++j)
    for (uint32_t i = 0; i < out.width; ++i) {
      const double x = (i - (out.width - 1) / 2.0) * pitch_mm, y = (j - (out.height - 1) / 2.0) * pitch_mm;
      double sum = 0;
      uint32_t count = 0;
      const double cell = pitch_mm * (0.5 - 0.5 / samples);  // to its outermost place
      if (std::abs(x + center_mm[0]) + cell <= reach_x && std::abs(y + center_mm[1]) + cell <= reach_y)
        for (uint32_t b = 0; b < samples; ++b)
          for (uint32_t a = 0; a < samples; ++a) {
            const double px = x + ((a + 0.5) / samples - 0.5) * pitch_mm,
                         py = y + ((b + 0.5) / samples - 0.5) * pitch_mm;
            sum += map_at(map, px + center_mm[0], py + center_mm[1]);
            ++count;
          }
      out.values[size_t{j} * out.width + i] =
          count > 0 ? static_cast<float>(sum / count) : std::numeric_limits<float>::quiet_NaN();
    }
  return out;
}

}  // namespace palpate
