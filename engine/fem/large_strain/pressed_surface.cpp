#include "engine/fem/large_strain/pressed_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/tissue/map_sampling.h"

namespace palpate::fem {
namespace {

/// A place on the surface at rest, in nodes from its corner, and how to take values there.
class SurfacePlace {
 public:
  SurfacePlace(const PressedSurface& surface, double x, double y)
      : width_(surface.width), x_(map_taps(x, surface.width)), y_(map_taps(y, surface.height)) {}
  double value(const std::vector<double>& of) const {
    double sum = 0;
    for (uint32_t r = 0; r < y_.count; ++r) {
      const double* const row = of.data() + (size_t{y_.first} + r) * width_ + x_.first;
      double along = 0;
      for (uint32_t c = 0; c < x_.count; ++c) along += x_.weight[c] * row[c];
      sum += y_.weight[r] * along;
    }
    return sum;
  }

 private:
  size_t width_;
  MapTaps x_, y_;
};

/// Deformed area that each node carries, mm^2.
std::vector<double> node_areas(const PressedSurface& s) {
  std::vector<double> area(s.force_N.size());
  const double gauss = 0.5 / std::sqrt(3.0);
  for (uint32_t y = 0; y + 1 < s.height; ++y)
    for (uint32_t x = 0; x + 1 < s.width; ++x) {
      const size_t n[] = {size_t{y} * s.width + x, size_t{y} * s.width + x + 1, size_t{y + 1} * s.width + x,
                          size_t{y + 1} * s.width + x + 1};
      for (int point = 0; point < 4; ++point) {
        const double a = 0.5 + (point & 1 ? gauss : -gauss), b = 0.5 + (point & 2 ? gauss : -gauss);
        const auto slope_x = [&](const std::vector<double>& u) {
          return ((1 - b) * (u[n[1]] - u[n[0]]) + b * (u[n[3]] - u[n[2]])) / s.pitch_mm[0];
        };
        const auto slope_y = [&](const std::vector<double>& u) {
          return ((1 - a) * (u[n[2]] - u[n[0]]) + a * (u[n[3]] - u[n[1]])) / s.pitch_mm[1];
        };
        const double stretch =
            (1 + slope_x(s.x_mm)) * (1 + slope_y(s.y_mm)) - slope_y(s.x_mm) * slope_x(s.y_mm);
        const double part = stretch * s.pitch_mm[0] * s.pitch_mm[1] / 4;
        area[n[0]] += part * (1 - a) * (1 - b);
        area[n[1]] += part * a * (1 - b);
        area[n[2]] += part * (1 - a) * b;
        area[n[3]] += part * a * b;
      }
    }
  return area;
}

}  // namespace

double PressedSurface::sum_N() const {
  return std::accumulate(force_N.begin(), force_N.end(), 0.0);
}

PressureField::PressureField(const PressedSurface& surface)
    : surface_(surface), pressure_Pa_(node_areas(surface)) {
  for (size_t n = 0; n < pressure_Pa_.size(); ++n)
    pressure_Pa_[n] = surface.force_N[n] / pressure_Pa_[n] * 1e6;
  const std::vector<double> mean = pressure_Pa_;
  for (uint32_t y = 1; y + 1 < surface.height; ++y)
    for (uint32_t x = 1; x + 1 < surface.width; ++x) {
      const size_t n = size_t{y} * surface.width + x, w = surface.width;
      pressure_Pa_[n] -= (mean[n - 1] + mean[n + 1] + mean[n - w] + mean[n + w] - 4 * mean[n]) / 12;
    }
}

double PressureField::at(double x_mm, double y_mm) const {
  const PressedSurface& s = surface_;
  const double i = x_mm / s.pitch_mm[0] + (s.width - 1) / 2.0,
               j = y_mm / s.pitch_mm[1] + (s.height - 1) / 2.0;
  // Where the tissue here was at rest: a fixed point, since tissue stretches by less than its size.
  double x = i, y = j;
  for (int round = 0; round < 60; ++round) {
    const SurfacePlace place(s, x, y);
    const double to_x = i - place.value(s.x_mm) / s.pitch_mm[0];
    const double to_y = j - place.value(s.y_mm) / s.pitch_mm[1];
    const double moved = std::abs(to_x - x) + std::abs(to_y - y);
    x = to_x;
    y = to_y;
    if (moved < 1e-7) break;
  }
  const double rim = 1e-6;
  const bool tissue = x >= -rim && y >= -rim && x <= s.width - 1 + rim && y <= s.height - 1 + rim;
  return tissue ? SurfacePlace(s, x, y).value(pressure_Pa_) : 0;
}

Map true_pressure(const PressedSurface& s, const std::array<uint32_t, 2>& nodes) {
  const PressureField field(s);
  Map map;
  map.width = nodes[0];
  map.height = nodes[1];
  const double length = (s.width - 1) * s.pitch_mm[0], width = (s.height - 1) * s.pitch_mm[1];
  map.pitch_mm = {length / (nodes[0] - 1), width / (nodes[1] - 1)};
  map.values.reserve(size_t{nodes[0]} * nodes[1]);
  for (uint32_t row = 0; row < nodes[1]; ++row)
    for (uint32_t column = 0; column < nodes[0]; ++column)
      map.values.push_back(static_cast<float>(
          field.at(column * map.pitch_mm[0] - length / 2, row * map.pitch_mm[1] - width / 2)));
  return map;
}

}  // namespace palpate::fem
