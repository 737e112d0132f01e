// Maps of floats on the GPU: the grids that surfaces are solved on.
#pragma once

#include <cstdint>
#include <string>

#include "engine/gpu/buffer.h"

namespace palpate {

/// A level's grid of cells: `height` rows of `pitch` texels of four floats.
struct Grid {
  uint32_t width = 0;
  uint32_t height = 0;
  uint32_t pitch = 0;  ///< texels
  uint64_t bytes() const { return uint64_t{pitch} * height * 16; }
};
Grid grid_for(uint32_t width, uint32_t height);
/// Half as many cells each way, rounded up.
Grid coarser(const Grid& grid);

/// A map of floats on the GPU that kernels may read in every shape they need.
struct FloatMap {
  FloatMap() = default;
  FloatMap(gpu::Context& context, const std::string& name, const Grid& grid);

  gpu::DeviceBuffer buffer;
  gpu::TexelView texels;  ///< RGBA32F
  gpu::TexelView pairs;   ///< RG32F
  gpu::TexelView words;   ///< R32F
};

}  // namespace palpate
