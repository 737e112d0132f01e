// Weighted solve's part of a frame slot.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/numeric/islands.h"
#include "engine/stages/surface/weighted_surface.h"

namespace palpate {

/// Memory of one frame in flight.
struct WeightedSlot {
  gpu::DeviceBuffer scalars;           ///< of the solve on the GPU
  gpu::Commands commands;              ///< the surface once more, with weights
  gpu::Commands plain;                 ///< or without, where weights were expected
  bool expected = false;               ///< weights, for the frame that was submitted
  gpu::Commands* again = nullptr;      ///< which of both ran for the frame that is measured
  gpu::DeviceBuffer slope_x, slope_y;  ///< Solve::Exact, on the host
  bool used = false;                   ///< the frame that is measured needs weights
  bool in_part = false;                ///< it shows all that every frame shows, which the plain solve knows
  WeightedStatistics statistics;
  Islands islands;
};

}  // namespace palpate
