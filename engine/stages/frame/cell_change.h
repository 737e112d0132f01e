// Cell change stage: how a colour frame differs from the untouched image, in cells of a few pixels.
#pragma once

#include <cstdint>

#include "engine/gpu/kernel.h"
#include "engine/stages/frame/upload.h"
#include "palpate/frame.h"
#include "shaders/shared/cell_change.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// Frames of three colours and 8 bits.
class CellChangeStage {
 public:
  CellChangeStage(gpu::Context& context, const FrameFormat& format);

  /// One shared::CellChange for each cell, row by row.
  uint64_t bytes() const { return uint64_t{push_.cells_x} * push_.cells_y * sizeof(shared::CellChange); }
  void record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
              const gpu::DeviceBuffer& cells) const;

 private:
  shared::CellChangePush push_{};
  gpu::Kernel kernel_;
};

}  // namespace palpate
