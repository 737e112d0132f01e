// Depths of a finished surface at a few places, without reading the whole map back.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/pipeline/surface_map.h"

namespace palpate {
namespace gpu {
class Context;
}

/// Depth, mm, at each place (x, y, px; beyond the frame: at its rim), bilinear between pixels; 0 in a
/// map of one row or column. Where the map's memory is not the host's, it waits for a copy of
/// those pixels alone. The map must be finished. `offset_mm`: SurfaceSummary::depth_offset_mm.
std::vector<float> sample_depths(gpu::Context& context, const SurfaceMap& map, double offset_mm,
                                 std::span<const std::array<double, 2>> places);

}  // namespace palpate
