// Weighted surface stage: the height map whose differences fit the slopes best where each slope counts by its
// weight, 0 to 1 (what is not known is left out): minimise the sum over faces of w (dz - g)^2.
// Conjugate gradients on the GPU; the preconditioner is one multigrid cycle with the weights of each level
// summed from the finer one's faces, so that the number of iterations hardly depends on size or mask. Nothing
// goes to the host before the end.
//
// A face takes the smaller weight of its two pixels. Faces of weight 0 say nothing: pixels without any other
// are filled smoothly from around, and the height between parts that only such faces join is not determined
// by the data (see engine/numeric/islands.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/numeric/islands.h"
#include "engine/stages/surface/surface.h"
#include "shaders/shared/weighted.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// Evidence of how good the heights are.
struct WeightedStatistics {
  double residual = 0;  ///< RMS of what the normal equations leave, relative to their right side's
  double unexplained =
      0;  ///< fraction of the weighted slopes that no surface explains: sqrt(sum w (dz - g)^2 / sum w g^2)
  uint32_t iterations = 0;  ///< of conjugate gradients
  bool converged = false;   ///< the residual is below kWeightedTolerance
};

/// Relative residual at which iterations stop: what single precision resolves.
inline constexpr float kWeightedTolerance = 1e-6f;

class WeightedSurface {
 public:
  static constexpr uint32_t kLiveIterations = 4;
  static constexpr uint32_t kConvergedIterations = 12;
  // Iterations of a pipeline's frame: Solve::Live, on cells of two by two pixels, and Solve::Converged.
  static constexpr uint32_t kCellIterations = 3, kFrameIterations = 5;

  /// `scale_mm_per_px` turns slopes times one px into mm.
  WeightedSurface(gpu::Context& context, uint32_t width, uint32_t height, double scale_mm_per_px,
                  uint32_t iterations);
  /// Solver for `cells` whose right side and faces the caller fills (record_given), with the field in
  /// `field_sums` parts.
  WeightedSurface(gpu::Context& context, const Grid& cells, uint32_t field_sums, uint32_t iterations);

  const Grid& grid() const { return levels_.front().grid; }
  /// Filled by the caller: d(depth)/dx and d(depth)/dy at pixel centres, and the pixels' weights, 0 to 1.
  /// What has weight 0 may hold anything, NaN too. The slopes' memory is used up by the solve.
  const FloatMap& slope_x() const { return direction_[1]; }
  const FloatMap& slope_y() const { return applied_; }
  const FloatMap& weights() const { return levels_.front().x[1]; }

  /// Solves into `depth`, mm, up to an additive constant. `scalars` (scalar_bytes()) gets the statistics.
  void record(gpu::Commands& commands, const FloatMap& depth, const gpu::DeviceBuffer& scalars) const;
  /// Faces and, in `right`, the right side only.
  void record_right_side(gpu::Commands& commands, const FloatMap& right) const;
  /// As `record`, for right_side(), across() and down() as the caller filled them, and field() for
  /// WeightedStatistics::unexplained.
  void record_given(gpu::Commands& commands, const FloatMap& depth, const gpu::DeviceBuffer& scalars) const;
  /// As `record`, for the right side that right_side() holds and the weights of the last record: a
  /// correction.
  void record_again(gpu::Commands& commands, const FloatMap& depth, const gpu::DeviceBuffer& scalars) const;
  /// Weights of each cell's right and lower face, 0 beyond the border and -kUnknownFace where a face says
  /// nothing.
  const FloatMap& across() const { return levels_.front().across; }
  const FloatMap& down() const { return levels_.front().down; }
  const FloatMap& right_side() const { return levels_.front().right; }
  /// Partial sums over faces of weight times squared difference.
  const gpu::DeviceBuffer& field() const { return field_; }
  /// Moves what has no known face of a solved `depth` towards the smooth filling; nothing else. After one
  /// call a plane is filled to 1 % of its range.
  void record_fill(gpu::Commands& commands, const FloatMap& depth) const;

  static constexpr uint64_t scalar_bytes() { return 64; }
  /// From the scalars of a finished solve, in host memory.
  static WeightedStatistics statistics(const gpu::DeviceBuffer& scalars);

  uint64_t memory_bytes() const;

 private:
  struct Level {
    Grid grid;
    FloatMap across, down;  ///< weights of right and lower faces
    FloatMap right;
    FloatMap x[2];
  };
  void cycle(gpu::Commands& commands, uint32_t level) const;
  void coarsen(gpu::Commands& commands) const;
  void solve(gpu::Commands& commands, const FloatMap& depth, const gpu::DeviceBuffer& scalars) const;
  void scalars(gpu::Commands& commands, uint32_t stage, const gpu::DeviceBuffer& scalars) const;
  shared::WeightedPush push(uint32_t level) const;
  uint32_t strips(const Grid& grid, uint32_t columns, uint32_t rows) const;
  void make(gpu::Context& context, const Grid& finest);
  void make_kernels(gpu::Context& context);

  uint32_t iterations_ = 0;
  uint32_t field_sums_ = 0;
  uint32_t rows_ = 0;  ///< that one invocation streams through
  float scale_ = 1;
  std::vector<Level> levels_;
  FloatMap direction_[2], applied_;
  gpu::DeviceBuffer field_, dots_, squares_;  ///< partial sums, one for each invocation
  gpu::TexelView field_words_, dot_words_, square_words_;
  gpu::Kernel faces_, coarsen_, sweep_zero_, sweep_correct_, sweep_present_, restrict_, coarsest_,
      direction_kernel_, start_, step_, fill_residual_, fill_, scalars_;
};

struct WeightedHeights {
  std::vector<float> values;  ///< rows x cols, mean 0, unit of the gradients times one pixel
  WeightedStatistics statistics;
  Solve solve = Solve::Live;  ///< that found them
  double peak_to_valley = 0;  ///< of the heights
  uint64_t kinks = 0;         ///< faces at which the slope jumps, where kinks were looked for
  Islands islands;            ///< of pixels with weight; their relative heights are not determined
};

/// Any gradient field with weights to heights. `gradients` is rows x cols x 2, d/dx then d/dy per pixel,
/// finite where the weight is not 0; `weights` is rows x cols, finite, at least 0; only their ratios matter.
/// Live: a few iterations. Converged: as many as it takes, with residuals in double precision in between.
/// Exact: double precision on the host. `kinks`: slopes that jump are cut there (cut_kinks). Throws
/// Error(Failure::Input).
WeightedHeights integrate_weighted(gpu::Context& context, std::span<const float> gradients,
                                   std::span<const float> weights, uint32_t rows, uint32_t cols, Solve solve,
                                   bool kinks = false);
/// SurfaceSolver::Best: Converged, and Exact where that does not converge.
WeightedHeights integrate_weighted(gpu::Context& context, std::span<const float> gradients,
                                   std::span<const float> weights, uint32_t rows, uint32_t cols,
                                   SurfaceSolver solver, bool kinks = false);

}  // namespace palpate
