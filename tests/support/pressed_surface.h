// The surface of a layer under exact contacts, on a grid of cells.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/elasticity/layer.h"
#include "engine/pad/layer_convolution.h"
#include "engine/pad/traction.h"

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
  /// The surface under these loads of the cells, MPa, and how far it moves along itself.
  void load(LayerConvolution& layer, const std::vector<double>& pressure, const std::vector<double>& shear_x,
            const std::vector<double>& shear_y) {
    std::vector<double> by_pressure, by_shear, px, py, x, y;
    layer.depth_by_pressure(pressure, by_pressure);
    layer.depth_by_shear(shear_x, shear_y, by_shear);
    layer.shift_by_pressure(pressure, px, py);
    layer.shift_by_shear(shear_x, shear_y, x, y);
    for (size_t i = 0; i < depth.size(); ++i) {
      depth[i] = static_cast<float>(by_pressure[i] + by_shear[i]);
      shift_x.push_back(static_cast<float>(px[i] + x[i]));
      shift_y.push_back(static_cast<float>(py[i] + y[i]));
    }
  }
  TractionInput input() const {
    return {.depth_mm = depth, .contact = contact, .shift_x_mm = shift_x, .shift_y_mm = shift_y};
  }

  TractionGrid grid;
  std::vector<float> depth;
  std::vector<uint8_t> contact;
  std::vector<float> shift_x, shift_y;  ///< of a loaded surface, mm
};

}  // namespace palpate
