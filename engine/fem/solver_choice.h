// Who solves the forward model's equations: the processor or a Vulkan device.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/fem/device/solver.h"
#include "engine/fem/linear/solver.h"

namespace palpate::fem {

class SolverChoice {
 public:
  /// Fewer nodes are solved on the processor before a device's kernels are compiled.
  static constexpr size_t kFewestForDevice = 60000;

  /// Keeps grid and team, which outlive it.
  SolverChoice(const CellGrid& grid, double poisson, const Options& options, WorkTeam& team);

  /// Makes the solver for these supports where there is none. Throws as Solver and, where the device
  /// is insisted on, DeviceSolver do.
  void hold(const FixedNodes& fixed);
  /// The supports are others from now on. Who solves stays, and its kernels.
  void release();

  /// As Solver::solve; hold() came before. Under Worker::Auto the first one times two
  /// iterations of each and keeps the faster.
  SolveStatistics solve(const std::vector<double>& load, std::vector<double>& displacement, double residual,
                        uint32_t most_iterations);
  void forces(const std::vector<double>& displacement, std::vector<double>& force);
  const Stiffness& stiffness() const { return stiffness_; }
  uint64_t bytes() const;
  /// Who solves and why, one line: "processor", "llvmpipe", "processor (12.1 ms an iteration; llvmpipe 60
  /// ms)".
  const std::string& who() const { return who_; }

 private:
  void choose(const std::vector<double>& load, const std::vector<double>& displacement);
  gpu::Context* device_for_auto();

  const CellGrid& grid_;
  double poisson_;
  Options options_;
  WorkTeam& team_;
  Stiffness stiffness_;
  Worker worker_;  ///< Auto: not chosen yet
  gpu::Context* context_ = nullptr;
  std::shared_ptr<const Kernels> kernels_;
  std::unique_ptr<Solver> processor_;
  std::unique_ptr<DeviceSolver> device_;
  std::string who_;
};

}  // namespace palpate::fem
