// Height fields with exact gradients: the ground truth for surface reconstruction in tests and profiles.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace palpate::scenes {

struct HeightField {
  std::string name;
  std::function<double(double x, double y)> height;  ///< px
  std::function<std::pair<double, double>(double x, double y)> gradient;
};

/// A plane: what a pinned rim flattens.
inline HeightField tilt() {
  return {"tilt", [](double x, double y) { return 0.1 * x - 0.05 * y; },
          [](double, double) {
            return std::pair{0.1, -0.05};
          }};
}

inline HeightField gaussian(double cx, double cy, double sigma, double peak) {
  const auto height = [=](double x, double y) {
    return peak * std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (2 * sigma * sigma));
  };
  return {"Gaussian", height, [=](double x, double y) {
            const double z = height(x, y);
            return std::pair{-z * (x - cx) / (sigma * sigma), -z * (y - cy) / (sigma * sigma)};
          }};
}

/// Smooth and as wide as the frame: half a cosine each way, what an eigenvalue index off by one distorts
/// most.
inline HeightField broad_press(double width, double height, double peak) {
  const double kx = 3.14159265358979323846 / width, ky = 3.14159265358979323846 / height;
  return {"broad press",
          [=](double x, double y) { return peak * std::cos(kx * (x + 0.5)) * std::cos(ky * (y + 0.5)); },
          [=](double x, double y) {
            return std::pair{-peak * kx * std::sin(kx * (x + 0.5)) * std::cos(ky * (y + 0.5)),
                             -peak * ky * std::cos(kx * (x + 0.5)) * std::sin(ky * (y + 0.5))};
          }};
}

/// A ball pressed into a flat pad: slope jumps at the rim.
inline HeightField cap(double cx, double cy, double radius, double rim) {
  const double base = std::sqrt(radius * radius - rim * rim);
  return {"spherical cap",
          [=](double x, double y) {
            const double r2 = (x - cx) * (x - cx) + (y - cy) * (y - cy);
            return r2 < rim * rim ? std::sqrt(radius * radius - r2) - base : 0.0;
          },
          [=](double x, double y) {
            const double r2 = (x - cx) * (x - cx) + (y - cy) * (y - cy);
            if (r2 >= rim * rim) return std::pair{0.0, 0.0};
            const double z = std::sqrt(radius * radius - r2);
            return std::pair{-(x - cx) / z, -(y - cy) / z};
          }};
}

/// rows x cols x 2 exact gradients at pixel centres.
inline std::vector<float> gradients(const HeightField& field, uint32_t rows, uint32_t cols) {
  std::vector<float> out;
  for (uint32_t y = 0; y < rows; ++y) {
    for (uint32_t x = 0; x < cols; ++x) {
      const auto [p, q] = field.gradient(x, y);
      out.push_back(static_cast<float>(p));
      out.push_back(static_cast<float>(q));
    }
  }
  return out;
}

}  // namespace palpate::scenes
