// The tissue's surface as it lies under the plate, and the pressure that a sensor in the plate sees.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/fem/scene.h"

namespace palpate::fem {

/// Nodes of the whole surface, height x width, row by row along x: their force and where they went.
struct PressedSurface {
  uint32_t width = 0, height = 0;
  std::array<double, 2> pitch_mm = {0, 0};  ///< of the nodes at rest
  std::vector<double> force_N;              ///< along z, pressing counts up
  std::vector<double> x_mm, y_mm, z_mm;     ///< displacement, z into the tissue

  double sum_N() const;
};

/// Force over deformed area in the frame of the plate, in which the tissue has moved. Cubic between the
/// surface's nodes.
class PressureField {
 public:
  /// Keeps the surface, which outlives it. A node's force over its area is a mean of the pressure around it,
  /// low on a bump by pitch^2 / 12 of its curvature: taken back inside the rim.
  explicit PressureField(const PressedSurface& surface);

  /// Pa, at a place of the plate from the block's middle; 0 where no tissue is.
  double at(double x_mm, double y_mm) const;

 private:
  const PressedSurface& surface_;
  std::vector<double> pressure_Pa_;
};

/// The same at so many nodes along x and y over the block at rest.
Map true_pressure(const PressedSurface& surface, const std::array<uint32_t, 2>& nodes);

}  // namespace palpate::fem
