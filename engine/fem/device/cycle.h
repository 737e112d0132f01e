// The V-cycle of Multigrid on a Vulkan device: same grids, smoothing and coarsest solution, so that
// the correction is the same up to rounding.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/fem/device/grid.h"
#include "engine/fem/device/kernels.h"

namespace palpate::gpu {
class Commands;
}  // namespace palpate::gpu

namespace palpate::fem {
class DeviceCycle {
 public:
  /// Unknowns of the coarsest grid at most: its dense inverse then holds 9 MB.
  static constexpr size_t kMostCoarse = 1500;
  /// Why such a grid's cycle does not fit, one line; empty: it does.
  static std::string refusal(const CellGrid& grid);

  /// Keeps `grid` and `fixed`, which outlive it. Takes `kernels` where they fit, else compiles its own.
  /// Throws Error(Failure::Usage) with the refusal, or where the supports do not hold the block.
  DeviceCycle(gpu::Context& context, const CellGrid& grid, double poisson, const FixedNodes& fixed,
              std::shared_ptr<const Kernels> kernels);
  ~DeviceCycle();

  /// correction(), about the solution of K correction = right(); ends visible to what comes after. `sums`
  /// gets product_sums() partial sums of right times correction.
  void record(gpu::Commands& commands, const DeviceTexels& sums) const;
  /// residual() = right() - K correction() where displacements are free.
  void record_residual(gpu::Commands& commands) const;

  const std::shared_ptr<const Kernels>& kernels() const { return kernels_; }
  const DeviceGrid& finest() const;
  const DeviceTexels& right() const;
  const DeviceTexels& correction() const;
  const DeviceTexels& residual() const;
  /// Partial sums that one product leaves, of two doubles each.
  uint32_t product_sums() const { return finest().columns() * finest().segments(); }
  uint64_t bytes() const;

 private:
  struct Level;
  void cycle(gpu::Commands& commands, size_t index, const DeviceTexels& sums) const;
  void residual_of(gpu::Commands& commands, const Level& level) const;
  /// Steps `first` and on of the Chebyshev smoothing of x[0]; the result is there again.
  void smooth(gpu::Commands& commands, size_t index, int first, const DeviceTexels* sums) const;

  std::vector<std::unique_ptr<Level>> levels_;
  DeviceTexels dense_;  ///< inverse of the coarsest grid
  std::shared_ptr<const Kernels> kernels_;
};

}  // namespace palpate::fem
