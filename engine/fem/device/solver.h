// Solver on a Vulkan device: conjugate gradients in double precision, preconditioned by a V-cycle in
// single precision, all in its memory. The host looks at a few numbers between iterations.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/fem/device/cycle.h"
#include "engine/fem/linear/solver.h"
#include "engine/gpu/commands.h"

namespace palpate::fem {

class DeviceSolver {
 public:
  /// Why this device cannot solve this grid, one line; empty: it can.
  static std::string refusal(const gpu::Context& context, const CellGrid& grid);

  /// Keeps the grid, which outlives it. Takes `kernels` where they fit, else compiles its own. Throws
  /// Error(Failure::Device) with the refusal, or where memory runs out; Error(Failure::Usage) where the
  /// supports do not hold the block.
  DeviceSolver(gpu::Context& context, const CellGrid& grid, double poisson, FixedNodes fixed,
               std::shared_ptr<const Kernels> kernels = nullptr);

  /// For the next solver on this device.
  const std::shared_ptr<const Kernels>& kernels() const { return cycle_.kernels(); }

  /// As Solver::solve: same equations, same stopping rule, equal results up to rounding.
  SolveStatistics solve(const std::vector<double>& load, std::vector<double>& displacement, double residual,
                        uint32_t most_iterations);

  /// As Stiffness::apply with the supports, and Multigrid::precondition.
  void apply(const float* displacement, float* force);
  void apply(const double* displacement, double* force);
  void precondition(const float* residual, float* correction);

  enum class Piece { Product, WideProduct, Cycle, Iteration };
  /// One piece of the work on whatever its memory holds, and the wait for it: for measuring.
  void run(Piece piece) const;

  uint64_t bytes() const;

 private:
  void record_iteration(gpu::Commands& commands) const;
  void record_product(gpu::Commands& commands) const;
  void record_scalars(gpu::Commands& commands, uint32_t stage, uint32_t sums) const;
  void submit(gpu::Commands& commands) const;
  template <typename Real>
  void write_as(const DeviceTexels& to, const Real* values);
  template <typename Real>
  void read_as(const DeviceTexels& from, Real* values);
  void move(const gpu::DeviceBuffer& from, const gpu::DeviceBuffer& to, uint64_t bytes);

  gpu::Context& context_;
  FixedNodes fixed_;
  DeviceCycle cycle_;
  DeviceTexels displacement_, load_, residual_, direction_, product_;
  DeviceTexels sums_;
  gpu::DeviceBuffer scalars_, upload_, readback_;
  mutable gpu::Commands balance_, iteration_, iterations_, single_, wide_, precondition_, transfer_;
};

}  // namespace palpate::fem
