// Point sets with known partners: a written character, bent by random bumps, under noise, among strangers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "engine/numeric/matching/matching.h"

namespace palpate {

struct BentScene {
  uint32_t axes = 2;
  double bend = 0.05;  ///< of a bump, over a shape of size 1
  double noise_sd = 0;
  double outlier_ratio = 0;     ///< strangers to template points
  double missing_fraction = 0;  ///< of the target's own points, at random
  double turn_deg = 0;          ///< about the last axis
  double scale = 1;
  double shift = 0;  ///< of template and target, along all axes
  uint32_t seed = 1;
};

struct BentPoints {
  PointSet from, to, truth;             ///< truth: where the template's points went
  std::vector<int64_t> target_of_from;  ///< -1: it is not there
};

/// Eight strokes of 105 points in the plane; in space they lie on a hill.
inline PointSet character(uint32_t axes) {
  constexpr std::array<std::array<double, 4>, 8> kStrokes = {{{.1, .85, .9, .88},
                                                              {.5, .98, .48, .55},
                                                              {.15, .6, .85, .62},
                                                              {.2, .58, .12, .1},
                                                              {.82, .59, .85, .05},
                                                              {.3, .4, .7, .42},
                                                              {.5, .4, .5, .17},
                                                              {.3, .15, .7, .17}}};
  PointSet set{axes, {}};
  double whole = 0, passed = 0;
  for (const auto& [x0, y0, x1, y1] : kStrokes) whole += std::hypot(x1 - x0, y1 - y0);
  size_t stroke = 0;
  for (int k = 0; k < 105; ++k) {
    const double at = whole * (k + 0.5) / 105;
    const auto length = [&] {
      return std::hypot(kStrokes[stroke][2] - kStrokes[stroke][0], kStrokes[stroke][3] - kStrokes[stroke][1]);
    };
    while (at > passed + length()) passed += length(), ++stroke;
    const auto& [x0, y0, x1, y1] = kStrokes[stroke];
    const double t = (at - passed) / length(), x = x0 + t * (x1 - x0), y = y0 + t * (y1 - y0);
    set.coordinates.insert(set.coordinates.end(), {x, y});
    if (axes == 3)
      set.coordinates.push_back(0.3 * std::exp(-4 * (std::pow(x - 0.4, 2) + std::pow(y - 0.6, 2))));
  }
  return set;
}

class BentPointsMaker {
 public:
  explicit BentPointsMaker(const BentScene& scene) : scene_(scene), random_(scene.seed) {}

  BentPoints make() {
    BentPoints made;
    made.from = character(scene_.axes);
    made.truth = made.from;
    const size_t n = made.from.size();
    for (int bump = 0; bump < 12; ++bump) {
      std::array<double, 3> centre{}, push{};
      for (uint32_t c = 0; c < scene_.axes; ++c) {
        centre[c] = c < 2 ? -0.2 + 1.4 * even() : 0;
        push[c] = scene_.bend * normal();
      }
      for (size_t i = 0; i < n; ++i) {
        const auto p = made.from.at(i);
        const double r2 = std::pow(p[0] - centre[0], 2) + std::pow(p[1] - centre[1], 2);
        for (uint32_t c = 0; c < scene_.axes; ++c)
          made.truth.coordinates[i * scene_.axes + c] += push[c] * std::exp(-r2 / (2 * 0.25 * 0.25));
      }
    }
    const double angle = scene_.turn_deg * std::numbers::pi / 180;
    for (size_t i = 0; i < n; ++i) {
      double* p = made.truth.coordinates.data() + i * scene_.axes;
      const double x = p[0] - 0.5, y = p[1] - 0.5;
      p[0] = 0.5 + x * std::cos(angle) - y * std::sin(angle);
      p[1] = 0.5 + x * std::sin(angle) + y * std::cos(angle);
    }
    const uint32_t axes = scene_.axes;
    made.to.axes = axes;
    std::vector<double> loose;
    std::vector<int64_t> owner;
    std::array<double, 3> low{}, high{};
    low.fill(1e9), high.fill(-1e9);
    for (size_t i = 0; i < n; ++i) {
      if (even() < scene_.missing_fraction) continue;
      owner.push_back(static_cast<int64_t>(i));
      for (uint32_t c = 0; c < axes; ++c) {
        loose.push_back(made.truth.at(i)[c] + scene_.noise_sd * normal());
        low[c] = std::min(low[c], loose.back());
        high[c] = std::max(high[c], loose.back());
      }
    }
    for (size_t k = 0; k < static_cast<size_t>(std::lround(scene_.outlier_ratio * static_cast<double>(n)));
         ++k) {
      owner.push_back(-1);
      for (uint32_t c = 0; c < axes; ++c) loose.push_back(low[c] + (high[c] - low[c]) * even());
    }
    std::vector<size_t> order(owner.size());
    std::iota(order.begin(), order.end(), size_t{0});
    for (size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random_() % (i + 1)]);
    made.target_of_from.assign(n, -1);
    for (size_t j = 0; j < order.size(); ++j) {
      for (uint32_t c = 0; c < axes; ++c) made.to.coordinates.push_back(loose[order[j] * axes + c]);
      if (owner[order[j]] >= 0)
        made.target_of_from[static_cast<size_t>(owner[order[j]])] = static_cast<int64_t>(j);
    }
    for (PointSet* set : {&made.from, &made.to, &made.truth})
      for (double& v : set->coordinates) v = scene_.scale * v + scene_.shift;
    return made;
  }

 private:
  double even() { return (static_cast<double>(random_()) + 0.5) / 4294967296.0; }
  double normal() { return std::sqrt(-2 * std::log(even())) * std::cos(2 * std::numbers::pi * even()); }

  BentScene scene_;
  std::mt19937 random_;
};

inline BentPoints bent(const BentScene& scene) {
  return BentPointsMaker(scene).make();
}

/// Mean distance of two sets point by point.
inline double mean_miss(const PointSet& a, const PointSet& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    double d = 0;
    for (uint32_t c = 0; c < a.axes; ++c) d += std::pow(a.at(i)[c] - b.at(i)[c], 2);
    sum += std::sqrt(d);
  }
  return sum / static_cast<double>(a.size());
}

}  // namespace palpate
