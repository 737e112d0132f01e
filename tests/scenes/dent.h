// The slopes of a Gaussian dent as a user's gradient file holds them.
#pragma once

#include <cmath>

#include "capture/files/npy.h"

namespace palpate {

/// Slopes of a Gaussian dent per pixel, exact, and its depth.
inline NpyArray gaussian_slopes(size_t rows, size_t columns, double sigma, double depth) {
  NpyArray slopes{{rows, columns, 2}, {}};
  for (size_t y = 0; y < rows; ++y) {
    for (size_t x = 0; x < columns; ++x) {
      const double dx = static_cast<double>(x) - 30.25, dy = static_cast<double>(y) - 41.5;
      const double z = depth * std::exp(-(dx * dx + dy * dy) / (2 * sigma * sigma));
      slopes.values.push_back(static_cast<float>(-z * dx / (sigma * sigma)));
      slopes.values.push_back(static_cast<float>(-z * dy / (sigma * sigma)));
    }
  }
  return slopes;
}

}  // namespace palpate
