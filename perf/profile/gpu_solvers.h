// The engine's surface solvers on given slopes, each ready to be run again and again.
#pragma once

#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/stages/surface/slope.h"
#include "engine/stages/surface/surface.h"
#include "engine/stages/surface/weighted_surface.h"
#include "perf/profile/truths.h"

namespace palpate::perf {

/// Slopes on the GPU, shared by all solvers of one size.
class GpuSlopes {
 public:
  GpuSlopes(gpu::Context& context, const FrameSize& size);
  void load(const Truth& truth);

  const FrameSize& size() const { return size_; }
  const Grid& grid() const { return grid_; }
  const FloatMap& x() const { return x_; }
  const FloatMap& y() const { return y_; }

 private:
  FrameSize size_;
  Grid grid_;
  FloatMap x_, y_;
  gpu::DeviceBuffer up_x_, up_y_;
  gpu::Commands load_;
};

/// A height map on the GPU and the way back to the host.
class GpuHeights {
 public:
  GpuHeights(gpu::Context& context, const GpuSlopes& slopes);
  const FloatMap& map() const { return map_; }
  SurfaceErrors errors(const Truth& truth);

 private:
  const GpuSlopes& slopes_;
  FloatMap map_;
  gpu::DeviceBuffer staging_;
  gpu::Commands read_;
};

/// Surface: full multigrid.
class MultigridSolver {
 public:
  MultigridSolver(gpu::Context& context, const GpuSlopes& slopes, Solve solve);
  void prepare();  ///< makes the right side of the slopes that are loaded
  /// Uses the coarser right sides up: every solve wants its own `prepare`.
  void solve();
  /// Errors of a solve that is well prepared.
  SurfaceErrors errors(const Truth& truth);
  /// Height x width, as solvers on the CPU take it; after `prepare`, only of solvers on pixels.
  std::vector<float> right_side();

 private:
  const GpuSlopes& slopes_;
  Surface surface_;
  Slope slope_;
  GpuHeights heights_;
  gpu::DeviceBuffer right_;
  gpu::Commands prepare_, solve_, read_right_;
};

/// WeightedSurface with all weights 1. The solve uses its slopes up, so that copying them is part of its
/// time.
class WeightedSolver {
 public:
  WeightedSolver(gpu::Context& context, const GpuSlopes& slopes, uint32_t iterations);
  void prepare() {}
  void solve();
  SurfaceErrors errors(const Truth& truth) { return heights_.errors(truth); }

 private:
  const GpuSlopes& slopes_;
  WeightedSurface surface_;
  GpuHeights heights_;
  gpu::DeviceBuffer ones_, scalars_;
  gpu::Commands solve_;
};

}  // namespace palpate::perf
