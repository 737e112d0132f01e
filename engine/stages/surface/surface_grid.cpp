#include "engine/stages/surface/surface_grid.h"

#include "engine/gpu/context.h"

namespace palpate {

Grid grid_for(uint32_t width, uint32_t height) {
  return {width, height, (width + 3) / 4};
}

Grid coarser(const Grid& grid) {
  return grid_for((grid.width + 1) / 2, (grid.height + 1) / 2);
}

FloatMap::FloatMap(gpu::Context& context, const std::string& name, const Grid& grid)
    : buffer(context, name, grid.bytes(), gpu::Memory::Device),
      texels(context, buffer, VK_FORMAT_R32G32B32A32_SFLOAT),
      pairs(context, buffer, VK_FORMAT_R32G32_SFLOAT),
      words(context, buffer, VK_FORMAT_R32_SFLOAT) {}

}  // namespace palpate
