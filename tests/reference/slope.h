// Slopes and the right side of the surface problem in plain loops and double precision.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "tests/reference/contact.h"

namespace palpate::reference {

struct Slopes {
  std::vector<double> p, q;  ///< height x width: d(depth)/dx, d(depth)/dy
  uint64_t clipped = 0;      ///< pixels steeper than max_slope
  uint64_t on_the_edge = 0;  ///< pixels for which that hangs on the rounding of single precision
};

/// Lambert with the light along the viewing axis (Eq. 62-63); direction from the quadric through the means of
/// three by three blocks of eight by eight pixels.
inline Slopes shading_slopes(const Frame& image, const Frame& rest, const Sensor& sensor) {
  const int width = static_cast<int>(image.format.width), height = static_cast<int>(image.format.height);
  const std::vector<uint32_t> filtered = filtered_change(image, rest, sensor.signal);
  // The GPU keeps 16 bits: fraction bits are dropped above 8 bits a pixel.
  const double units = 256u >> (image.format.bit_depth > 8 ? image.format.bit_depth - 8 : 0);
  const auto gray = [&](int x, int y) {
    const size_t at = static_cast<size_t>(std::clamp(y, 0, height - 1) * width + std::clamp(x, 0, width - 1));
    return std::floor(filtered[at] * units / 256) / units;
  };
  const int across = (width + 7) / 8, down = (height + 7) / 8;
  std::vector<double> means;
  for (int by = 0; by < down; ++by) {
    for (int bx = 0; bx < across; ++bx) {
      double sum = 0;
      int count = 0;
      for (int y = 8 * by; y < std::min(8 * by + 8, height); ++y)
        for (int x = 8 * bx; x < std::min(8 * bx + 8, width); ++x, ++count) sum += gray(x, y);
      means.push_back(sum / count);
    }
  }
  const auto mean = [&](int bx, int by) {
    return means[static_cast<size_t>(std::clamp(by, 0, down - 1) * across + std::clamp(bx, 0, across - 1))];
  };
  Slopes s;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double g = gray(x, y);
      const int bx = x / 8, by = y / 8;
      const double u = (x % 8 - 3.5) / 8, v = (y % 8 - 3.5) / 8;
      const double uv =
          (mean(bx + 1, by + 1) - mean(bx + 1, by - 1) - mean(bx - 1, by + 1) + mean(bx - 1, by - 1)) / 4;
      double dx = uv * v, dy = uv * u;
      for (int k = -1; k <= 1; ++k) {
        const double w = k == 0 ? 0.5 : 0.25;
        dx += w * ((mean(bx + 1, by + k) - mean(bx - 1, by + k)) / 2 +
                   u * (mean(bx + 1, by + k) - 2 * mean(bx, by + k) + mean(bx - 1, by + k)));
        dy += w * ((mean(bx + k, by + 1) - mean(bx + k, by - 1)) / 2 +
                   v * (mean(bx + k, by + 1) - 2 * mean(bx + k, by) + mean(bx + k, by - 1)));
      }
      double tangent = 0;
      if (g >= sensor.threshold_gray && g > 0) {
        const double ratio = sensor.shading.facing_gray / g;
        s.clipped += ratio > std::hypot(1, sensor.max_slope);
        tangent = std::min(std::sqrt(std::max(ratio * ratio - 1, 0.0)), sensor.max_slope) *
                  sensor.shading.depth_gain;
      }
      const double size = std::hypot(dx, dy);
      s.p.push_back(size > 0 ? tangent * dx / size : 0);
      s.q.push_back(size > 0 ? tangent * dy / size : 0);
    }
  }
  return s;
}

/// Normal by weights of colours and their products, polynomials of place (see PhotometricCalibration).
inline Slopes photometric_slopes(const Frame& image, const Frame& rest, const Sensor& sensor) {
  const uint32_t width = image.format.width, height = image.format.height;
  Slopes s;
  for (uint32_t y = 0; y < height; ++y) {
    for (uint32_t x = 0; x < width; ++x) {
      const double X = (2.0 * x + 1) / width - 1, Y = (2.0 * y + 1) / height - 1;
      const double terms[] = {1, X, Y, X * X, X * Y, Y * Y, X * X * X, X * X * Y, X * Y * Y, Y * Y * Y};
      std::vector<double> colours;
      for (uint32_t channel = 0; channel < 3; ++channel)
        colours.push_back((static_cast<double>(image.at(channel, x, y)) - rest.at(channel, x, y)) /
                          image.format.max_gray());
      for (size_t i = 0; i < 3; ++i)
        for (size_t j = i; j < 3; ++j) colours.push_back(colours[i] * colours[j]);
      double nx = 0, ny = 0;
      for (size_t colour = 0; colour < sensor.photometric.wx.size(); ++colour)
        for (size_t term = 0; term < sensor.photometric.wx[colour].size(); ++term) {
          nx += sensor.photometric.wx[colour][term] * terms[term] * colours[colour];
          ny += sensor.photometric.wy[colour][term] * terms[term] * colours[colour];
        }
      const double across = std::hypot(nx, ny);
      const double excess = across * std::hypot(1, sensor.max_slope) / sensor.max_slope - 1;
      s.clipped += excess > 0;
      s.on_the_edge += std::abs(excess) < 1e-5;
      const double slope =
          across < 1 ? std::min(across / std::sqrt(1 - across * across), sensor.max_slope) : sensor.max_slope;
      s.p.push_back(across > 0 ? slope * nx / across : 0);
      s.q.push_back(across > 0 ? slope * ny / across : 0);
    }
  }
  return s;
}

/// Integral of the cubic through samples i - 1 .. i + 2 from i to i + 1; a missing sample is extrapolated
/// linearly.
template <typename Sample>
double pair_integral(const Sample& at, int i, int n) {
  const double b = at(i), c = at(i + 1);
  const double a = i >= 1 ? at(i - 1) : 2 * b - c;
  const double d = i + 2 < n ? at(i + 2) : 2 * c - b;
  return (-a + 13 * b + 13 * c - d) / 24;
}

/// (A z)_i = sum over neighbours (z_i - z_j) must equal this; height x width, mm.
inline std::vector<double> right_side(const Slopes& s, uint32_t width, uint32_t height, double pitch_mm) {
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  std::vector<double> f(s.p.size());
  for (int y = 0; y < h; ++y) {
    const auto p = [&](int x) { return s.p[static_cast<size_t>(y * w + x)]; };
    for (int x = 0; x + 1 < w; ++x) {
      const double step = pair_integral(p, x, w) * pitch_mm;
      f[static_cast<size_t>(y * w + x)] -= step;
      f[static_cast<size_t>(y * w + x + 1)] += step;
    }
  }
  for (int x = 0; x < w; ++x) {
    const auto q = [&](int y) { return s.q[static_cast<size_t>(y * w + x)]; };
    for (int y = 0; y + 1 < h; ++y) {
      const double step = pair_integral(q, y, h) * pitch_mm;
      f[static_cast<size_t>(y * w + x)] -= step;
      f[static_cast<size_t>((y + 1) * w + x)] += step;
    }
  }
  return f;
}

}  // namespace palpate::reference
