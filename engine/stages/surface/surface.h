// Surface stage: the height map whose differences fit the slopes best (least squares with natural boundary),
// by full multigrid on the GPU. No path, no pinned rim, and the tilt of the frame is kept.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/kernel.h"
#include "engine/gpu/tuning.h"
#include "engine/stages/surface/edge_sources.h"
#include "engine/stages/surface/solve.h"
#include "engine/stages/surface/surface_grid.h"
#include "palpate/options.h"
#include "shaders/shared/grid.h"

namespace palpate {
namespace gpu {
class Commands;
}

/// Which right sides a solve reads: the one for pixels and that for cells of two by two of them, or the
/// latter only.
enum class RightSides { Pixels, Cells };

class Surface {
 public:
  /// Extra cycles at full resolution after the full-multigrid pass; each reduces the error by about ten.
  static constexpr uint32_t kConvergedCycles = 6;

  /// Solve::Live solves on cells and holds the right side for pixels only where `keep_pixels` asks for it or
  /// the frame is so small that it is solved directly. Solve::Exact leaves the solving to the host.
  Surface(gpu::Context& context, uint32_t width, uint32_t height, Solve solve, const Tuning& tuning,
          bool keep_pixels = false);

  RightSides right_sides() const { return right_sides_; }

  /// From what is recorded after this on, the heights of the known pixels are solved by themselves: `known`
  /// is height x width, not 0 where one is, in every frame; right sides then hold known faces only. What is
  /// unknown goes on harmonically. Another solve of all pixels as before, and false, where the known ones
  /// hang together in several parts, their edge is too long (kMostEdgeCells) or the frame is solved directly.
  /// Takes up to a few seconds.
  bool set_known(gpu::Context& context, std::span<const uint8_t> known);
  bool solves_known_part() const { return edge_.has_value(); }

  const Grid& grid() const { return levels_.front().grid; }
  /// Filled by the slope stage: for each pixel the height differences to its left and upper neighbour minus
  /// those to its right and lower one, mm.
  /// Empty where right_sides() is RightSides::Cells.
  const FloatMap& right_side() const { return levels_.front().right; }
  /// Filled by the slope stage too: the sums of right_side() over blocks of two by two pixels.
  const FloatMap& coarse_right_side() const { return levels_.size() > 1 ? levels_[1].right : unused_coarse_; }

  /// Solves into `depth`, mm, up to an additive constant.
  void record(gpu::Commands& commands, const FloatMap& depth) const;
  /// Sums right_side() over blocks into coarse_right_side(), where the slope stage has not done so.
  void record_coarse_right_side(gpu::Commands& commands) const;
  /// Heights of the cells of two by two pixels to those of pixels, by cubics.
  void record_interpolation(gpu::Commands& commands, const FloatMap& cells, const FloatMap& depth) const;

  uint64_t memory_bytes() const;

 private:
  struct Level {
    Grid grid;
    float across = 1;  ///< coupling of neighbours in a row: height over width of a cell
    float down = 1;
    float edge_width = 1;   ///< of the last column's cells: halving an odd number leaves a narrower one
    float edge_height = 1;  ///< of the last row's cells
    FloatMap right;
    FloatMap x[2];  ///< present and next solution; level 0 writes the last one into the caller's map
  };
  struct Pass;
  void make_strips(gpu::Context& context);
  void make_tiles(gpu::Context& context);
  void make_correcting(gpu::Context& context);
  void make_coarse_levels(gpu::Context& context);
  bool tiled() const { return tuning_.surface_tiles != 0; }
  /// Workgroup of the kernels that are not tiles, where the others are: many small ones, each invocation one
  /// row.
  static constexpr uint32_t kSmallWorkgroup = 64;
  gpu::KernelInterface interface(std::vector<gpu::Binding> bindings, bool in_tiles) const;

  Tuning tuning_;
  RightSides right_sides_ = RightSides::Pixels;
  uint32_t extra_cycles_ = 0;
  std::vector<Level> levels_;
  std::optional<EdgeSources> edge_;
  FloatMap unused_coarse_;  ///< takes sums of a level that is not there
  gpu::DeviceBuffer inverse_;
  gpu::TexelView inverse_texels_;
  /// In tiles the levels from here on are one workgroup's, in one dispatch; 0: each by itself.
  uint32_t coarse_first_ = 0;
  gpu::TexelView inverse_words_;
  gpu::Kernel descend_, ascend_, ascend_corrected_, interpolate_, interpolate_corrected_, smooth_, restrict_,
      restrict_residual_, correct_, coarsest_, coarse_pass_, coarse_cycle_;
};

/// Evidence of how good an answer is.
struct SurfaceStatistics {
  double residual = 0;  ///< RMS of what the normal equations leave, relative to the RMS of their right side
  /// RMS of the differences of height that the gradients ask for and no height map gives, relative to the RMS
  /// of those asked for: 0 for the gradients of a surface, up to 1 for a field that only turns.
  double inconsistency = 0;
  double peak_to_valley = 0;  ///< of the heights
};

struct Heights {
  std::vector<float> values;  ///< rows x cols, mean 0, unit of the gradients times one pixel
  SurfaceStatistics statistics;
  Solve solve = Solve::Live;  ///< that found them
};

/// Any gradient field to heights: `gradients` is rows x cols x 2, d/dx then d/dy per pixel, of any finite
/// size. Throws Error(Failure::Input) naming the place of a gradient that is not finite, and where heights
/// would not fit single precision. Used by `palpate integrate`.
Heights integrate_gradients(gpu::Context& context, std::span<const float> gradients, uint32_t rows,
                            uint32_t cols, Solve solve);
/// The same by what choose_solve() finds for SurfaceSolver::Best.
Heights integrate_gradients(gpu::Context& context, std::span<const float> gradients, uint32_t rows,
                            uint32_t cols, SurfaceSolver solver);

}  // namespace palpate
