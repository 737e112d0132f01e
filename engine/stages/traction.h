// Traction stage: pressure on a bonded layer from the shape of its surface, on the GPU; the problem and its
// constrained conjugate gradients are those of engine/pad/traction.h.
//
// The layer's answer C is even in both directions. Along rows it is a sum of cosines of differences,
// cos k (x - x') = cos kx cos kx' + sin kx sin kx', which with the period of twice the row less two cells is
// exact; along columns each wave is a sum over distances. Matrix products, a multiple of the cells times
// width and height, that need no complex numbers and no shared memory.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/kernel.h"
#include "engine/pad/traction.h"
#include "engine/stages/surface/surface_grid.h"
#include "shaders/shared/traction.h"

namespace palpate {
class LayerKernel;
namespace gpu {
class Context;
}  // namespace gpu

/// Results of one frame, without errors and shear.
struct TractionReading {
  std::span<const float> pressure_MPa;  ///< height x width, >= 0; valid until the slot's next frame
  double force_N = 0;                   ///< into the layer
  double mx_Nmm = 0;                    ///< about the middle of the grid, as Wrench::moment_Nmm
  double my_Nmm = 0;
  double residual = 0;   ///< gradient that is left, relative to that of no traction
  double slope_rms = 0;  ///< of the depth's slopes that no pressure explains
  uint32_t iterations = 0;
  bool converged = false;
  bool at_border = false;  ///< pressure in the outermost cells: what presses beyond is missing
};

class TractionStage {
 public:
  static constexpr uint32_t kIterations = 12;  ///< of a frame; the next one begins where it ended

  /// How the work is cut: what is fast depends on the device, the result hardly.
  struct Blocks {
    uint32_t workgroup = 0;     ///< invocations
    uint32_t lanes = 0;         ///< of the kernels that are one workgroup
    uint32_t row_block = 0;     ///< rows of an invocation that transforms rows: 1, 2, 4 or 8
    uint32_t column_block = 0;  ///< of one that answers along columns, likewise
  };
  static Blocks blocks_for(const gpu::Context& context);

  /// Only the options slope_sd and tolerance count. Throws Error(Failure::Input) as TractionSolver, and where
  /// no iterations are wanted.
  TractionStage(gpu::Context& context, const Pad& pad, const TractionGrid& grid,
                const TractionOptions& options, uint32_t iterations = kIterations);
  TractionStage(gpu::Context& context, const Pad& pad, const TractionGrid& grid,
                const TractionOptions& options, uint32_t iterations, const Blocks& blocks);

  const TractionGrid& grid() const { return grid_; }

  /// A frame in flight.
  struct Slot {
    gpu::DeviceBuffer depth;  ///< height x width floats, mm into the layer, up to a constant; on the GPU
    gpu::TexelView depth_words;
    gpu::DeviceBuffer flags;  ///< height x width bytes of kTractionContact and kTractionKnown; host memory
    gpu::TexelView flag_bytes;
    gpu::DeviceBuffer pressure;  ///< height x width floats, MPa; host memory
    gpu::DeviceBuffer state, records;
  };
  Slot slot(gpu::Context& context) const;
  /// Where pressure may be and where the depth is known (0: not), height x width; empty: everywhere. For the
  /// slot's next submission. Throws Error(Failure::Input) on another size.
  void write_masks(const Slot& slot, std::span<const uint8_t> contact, std::span<const uint8_t> known) const;

  /// The slot's depth to its pressure. A depth that is not finite, or beyond 1e6 mm, counts as not known.
  /// Frames run one after the other, each from the pressure of the one before, whichever slot that had.
  void record(gpu::Commands& commands, const Slot& slot) const;
  /// Reads the results of a finished submission.
  TractionReading read(const Slot& slot) const;
  /// The next frame begins from nothing. No frame may be in flight.
  void forget(gpu::Context& context) const;

  uint64_t memory_bytes() const;

 private:
  void make_tables(gpu::Context& context, const LayerKernel& kernel);
  void make_kernels(gpu::Context& context);
  void right_side(gpu::Commands& commands) const;
  void press(gpu::Commands& commands, const FloatMap& from, uint32_t first) const;
  void gradient(gpu::Commands& commands) const;
  void iterate(gpu::Commands& commands) const;
  gpu::IndirectGroups counted(uint32_t dispatch) const;

  TractionGrid grid_;
  uint32_t iterations_;
  Blocks blocks_;
  shared::TractionPush push_{};
  FloatMap depth_, known_, contact_, pressure_, gradient_, direction_;
  FloatMap moved_;        ///< depth by the direction
  FloatMap unexplained_;  ///< depth less that by pressure
  FloatMap laplacian_, mixed_, answered_;
  FloatMap waves_, answers_;  ///< tables
  gpu::DeviceBuffer sums_, state_, groups_;
  gpu::TexelView sum_texels_;
  gpu::Kernel prepare_kernel_, laplacian_kernel_, rows_kernel_, rows_contact_kernel_, columns_kernel_,
      columns_contact_kernel_, back_depth_kernel_, back_unexplained_kernel_, back_gradient_kernel_,
      back_right_kernel_, start_kernel_, direction_kernel_, step_kernel_, finish_kernel_;
};

}  // namespace palpate
