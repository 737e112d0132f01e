// Cell heights stage: the mean height of each small cell, for what the host does with a surface.
#pragma once

#include <cstdint>

#include "engine/gpu/kernel.h"
#include "engine/stages/surface/surface_grid.h"
#include "shaders/shared/cell_change.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

class CellHeights {
 public:
  CellHeights(gpu::Context& context, const Grid& grid);

  /// Cells of shared::kCellSide px, the last of a row or column smaller.
  uint32_t cells_x() const { return push_.cells_x; }
  uint32_t cells_y() const { return push_.cells_y; }
  /// Size of the means of one map.
  uint64_t bytes() const { return uint64_t{push_.cells_x} * push_.cells_y * sizeof(float); }
  const shared::CellChangePush& push() const { return push_; }

  /// cells_y() x cells_x() floats, mm.
  void record(gpu::Commands& commands, const FloatMap& depth, const gpu::DeviceBuffer& means) const;

 private:
  shared::CellChangePush push_{};
  gpu::Kernel kernel_;
};

}  // namespace palpate
