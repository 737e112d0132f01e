// Helpers for tests of whole pipelines.
#pragma once

#include <vector>

#include "engine/stages/surface/solve.h"
#include "palpate/pipeline.h"

namespace palpate {

/// `options` with the surface solved that way.
inline PipelineOptions solved(Solve solve, PipelineOptions options = {}) {
  options.solver = solve == Solve::Live ? SurfaceSolver::Live : SurfaceSolver::Best;
  options.solve_by = solve == Solve::Exact ? SolveBy::Host : SolveBy::Device;
  return options;
}

/// A copy of the depth map, mm, that outlives the result.
inline std::vector<float> depth_map(const Result& result) {
  const std::span<const float> depth = result.depth_mm();
  return {depth.begin(), depth.end()};
}

}  // namespace palpate
