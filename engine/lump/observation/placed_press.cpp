#include "engine/lump/observation/placed_press.h"

#include <algorithm>
#include <cmath>

#include "engine/base/numbers.h"
#include "engine/lump/observation/pad_tilt.h"
#include "engine/tissue/map_sampling.h"

namespace palpate::lump {
namespace {

constexpr double kLifted = 0.5;  // of a load, under a plate that is tilted off the place

/// A node's pressure at another force: pressure over force is nearly straight in force. `load_N`: of a level
/// plate that would press there as each of the press's loads did; those that hardly did say nothing.
double at_force(const Observation& r, size_t node, double force_N, const std::vector<double>& load_N) {
  const size_t all = load_N.size();
  size_t k = 0;
  while (k + 2 < all && (load_N[k + 1] < force_N || load_N[k] < kLifted * force_N)) ++k;
  const bool one = all == 1 || load_N[k] < kLifted * force_N;
  const double high = load_N[std::min(k + 1, all - 1)], low = one ? high : load_N[k];
  if (high < kLifted * force_N) return kNaN;
  const double t = one ? 0 : (force_N - low) / (high - low);
  const double b = static_cast<double>(r.pressure_Pa[std::min(k + 1, all - 1)].values[node]) / high,
               a = one ? b : static_cast<double>(r.pressure_Pa[k].values[node]) / low;
  return force_N * ((1 - t) * a + t * b);
}

/// Sum of the products of two interpolations' weights: covariance of the values by noise of unit variance at
/// each node.
double alike(const MapTaps& a, const MapTaps& b) {
  double sum = 0;
  for (uint32_t i = 0; i < a.count; ++i)
    for (uint32_t k = 0; k < b.count; ++k)
      if (a.first + i == b.first + k) sum += a.weight[i] * b.weight[k];
  return sum;
}

}  // namespace

void Placed::read(const Observation& r, const std::vector<double>& forces_N) {
  taken = place.tail<2>();
  maps.assign(forces_N.size(), r.pressure_Pa[0]);
  std::vector<double> compression;
  for (const double force_N : r.force_N) compression.push_back(compression_at(r, force_N));
  rise.clear();
  for (const double force_N : forces_N) rise.push_back(rise_with_compression(compression_at(r, force_N)));
  const PressureMap& window = r.pressure_Pa[0];
  std::vector<double> load_N = r.force_N;
  for (uint32_t j = 0; j < window.height; ++j)
    for (uint32_t i = 0; i < window.width; ++i) {
      const double u = (i - (window.width - 1) / 2.0) * window.pitch_mm[0],
                   v = (j - (window.height - 1) / 2.0) * window.pitch_mm[1];
      const double c = std::cos(turn_rad), s = std::sin(turn_rad);
      const double deeper = taken(0) * (stage_mm[0] + place(0) + c * u - s * v) +
                            taken(1) * (stage_mm[1] + place(1) + s * u + c * v);
      for (size_t k = 0; k < load_N.size() && deeper != 0; ++k)
        load_N[k] = r.force_N[k] * load_share(compression[k], deeper);
      const size_t node = size_t{j} * window.width + i;
      for (size_t k = 0; k < forces_N.size(); ++k)
        maps[k].values[node] = static_cast<float>(at_force(r, node, forces_N[k], load_N));
    }
}

double Placed::compression_at(const Observation& r, double force_N) {
  return compression_under(1e6 * force_N / (r.block_mm[0] * r.block_mm[1]), r.young_Pa);
}

double Placed::scale(size_t load, double x_mm, double y_mm) const {
  const Eigen::Vector2d more = place.tail<2>() - taken;
  if (more.isZero(0)) return std::exp(-place(2));
  return std::exp(-place(2) - rise[load] * (more(0) * x_mm + more(1) * y_mm));
}

std::array<double, 2> Placed::in_window(double x_mm, double y_mm) const {
  const double x = x_mm - stage_mm[0] - place(0), y = y_mm - stage_mm[1] - place(1);
  if (turn_rad == 0) return {x, y};
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return {c * x + s * y, c * y - s * x};
}

Eigen::Vector2d Placed::with_slopes(double x_mm, double y_mm, double step_mm) const {
  const PressureMap& map = maps[0];
  const auto [x, y] = in_window(x_mm, y_mm);
  const auto taps = [&](int axis, double at_mm) {
    const uint32_t count = axis == 0 ? map.width : map.height;
    return map_taps(at_mm / map.pitch_mm[static_cast<size_t>(axis)] + (count - 1) / 2.0, count);
  };
  const auto slope = [&](int axis, double at_mm) {
    const MapTaps value = taps(axis, at_mm);
    return (alike(value, taps(axis, at_mm + step_mm)) - alike(value, taps(axis, at_mm - step_mm))) /
           (2 * step_mm);
  };
  const double along = slope(0, x) * alike(taps(1, y), taps(1, y)),
               across = slope(1, y) * alike(taps(0, x), taps(0, x));
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return noise_Pa * noise_Pa * Eigen::Vector2d(c * along - s * across, s * along + c * across);
}

double Placed::at(size_t load, double x_mm, double y_mm) const {
  if (edge_mm(x_mm, y_mm) < -1e-9) return kNaN;
  const auto [x, y] = in_window(x_mm, y_mm);
  return map_at(maps[load], x, y) * scale(load, x_mm, y_mm);
}

double Placed::edge_mm(double x_mm, double y_mm) const {
  const PressureMap& map = maps[0];
  const auto [x, y] = in_window(x_mm, y_mm);
  return std::min(map.pitch_mm[0] * (map.width - 1) / 2 - std::abs(x),
                  map.pitch_mm[1] * (map.height - 1) / 2 - std::abs(y));
}

double Placed::near(size_t load, double x_mm, double y_mm) const {
  if (const double v = at(load, x_mm, y_mm); std::isfinite(v) || edge_mm(x_mm, y_mm) < -1e-9) return v;
  const PressureMap& map = maps[load];
  const auto [x, y] = in_window(x_mm, y_mm);
  const double i = x / map.pitch_mm[0] + (map.width - 1) / 2.0,
               j = y / map.pitch_mm[1] + (map.height - 1) / 2.0;
  const uint32_t i0 = std::min(static_cast<uint32_t>(std::max(0.0, i)), map.width - 2),
                 j0 = std::min(static_cast<uint32_t>(std::max(0.0, j)), map.height - 2);
  double sum = 0, seen = 0;
  for (const uint32_t b : {0u, 1u})
    for (const uint32_t a : {0u, 1u}) {
      const double v = static_cast<double>(map.at(i0 + a, j0 + b));
      const double w = (a ? i - i0 : 1 - (i - i0)) * (b ? j - j0 : 1 - (j - j0));
      if (!std::isfinite(v)) continue;
      sum += w * v;
      seen += w;
    }
  return seen >= 0.5 ? sum / seen * scale(load, x_mm, y_mm) : kNaN;
}

}  // namespace palpate::lump
