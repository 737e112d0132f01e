// Weighted solve's part of a frame slot.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/numeric/islands.h"
#include "engine/stages/weighted_surface.h"

namespace palpate {

/// What one frame in flight owns.
struct WeightedSlot {
  gpu::DeviceBuffer scalars;           ///< of the solve on the GPU
  gpu::Commands commands;              ///< Weights::WhereNeeded: the surface once more
  gpu::DeviceBuffer slope_x, slope_y;  ///< SurfaceSolver::Exact, on the host
  bool used = false;                   ///< the frame that is measured needs weights
  WeightedStatistics statistics;
  Islands islands;
};

}  // namespace palpate
