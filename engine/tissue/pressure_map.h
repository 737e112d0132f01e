// Pressure on a tissue's surface, at nodes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// A map over the tissue's surface, one value per node: height x width, row by row along x.
struct PressureMap {
  uint32_t width = 0, height = 0;
  std::array<double, 2> pitch_mm = {0, 0};
  std::vector<float> values;

  float at(uint32_t x, uint32_t y) const { return values[size_t{y} * width + x]; }
};

}  // namespace palpate
