// The surface of a layer under exact contacts, on a grid of cells.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/elasticity/layer.h"
#include "engine/elasticity/traction.h"

namespace palpate {

/// Presses as superpositions of exact contacts, on a grid.
struct PressedSurface {
  explicit PressedSurface(const TractionGrid& on)
      : grid(on), depth(size_t{on.width} * on.height), contact(depth.size()) {}
  /// Each cell's mean of the depth; contact within the contact's circle and half a cell.
  void add(const LayerContact& press, double at_x, double at_y) {
    constexpr int kParts = 6;
    for (size_t i = 0; i < depth.size(); ++i) {
      const double x = x_of(i) - at_x, y = y_of(i) - at_y;
      double sum = 0;
      for (int a = 0; a < kParts; ++a)
        for (int b = 0; b < kParts; ++b)
          sum += press.deflection_mm(std::hypot(x + ((a + 0.5) / kParts - 0.5) * grid.cell_mm,
                                                y + ((b + 0.5) / kParts - 0.5) * grid.cell_mm));
      depth[i] += static_cast<float>(sum / (kParts * kParts));
      if (std::hypot(x, y) < press.summary().radius_mm + 0.7 * grid.cell_mm) contact[i] = 1;
    }
  }
  double x_of(size_t i) const {
    return (static_cast<double>(i % grid.width) + 0.5 - grid.width / 2.0) * grid.cell_mm;
  }
  double y_of(size_t i) const {
    return (static_cast<double>(i / grid.width) + 0.5 - grid.height / 2.0) * grid.cell_mm;
  }
  TractionInput input() const { return {.depth_mm = depth, .contact = contact}; }

  TractionGrid grid;
  std::vector<float> depth;
  std::vector<uint8_t> contact;
};

}  // namespace palpate
