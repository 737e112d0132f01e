// Who solves the forward model's equations: the processor or a Vulkan device.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/fem/device/solver.h"
#include "engine/fem/linear/solver.h"

namespace palpate {

class ForwardChoice {
 public:
  /// Fewer nodes are solved on the processor before a device's kernels are compiled.
  static constexpr size_t kFewestForDevice = 60000;

  /// Keeps grid and team, which outlive it.
  ForwardChoice(const ForwardGrid& grid, double poisson, const ForwardOptions& options, WorkTeam& team);

  /// Makes the solver for these supports where there is none. Throws as ForwardSolver and, where the device
  /// is insisted on, ForwardDevice do.
  void hold(const FixedNodes& fixed);
  /// The supports are others from now on. Who solves stays, and its kernels.
  void release();

  /// As ForwardSolver::solve; hold() came before. Under ForwardWorker::Auto the first one times two
  /// iterations of each and keeps the faster.
  SolveEvidence solve(const std::vector<double>& load, std::vector<double>& displacement, double residual,
                      uint32_t most_iterations);
  void forces(const std::vector<double>& displacement, std::vector<double>& force);
  const ForwardOperator& stiffness() const { return stiffness_; }
  uint64_t bytes() const;
  /// Who solves and why, one line: "processor", "llvmpipe", "processor (12.1 ms an iteration; llvmpipe 60
  /// ms)".
  const std::string& who() const { return who_; }

 private:
  void choose(const std::vector<double>& load, const std::vector<double>& displacement);
  gpu::Context* device_for_auto();

  const ForwardGrid& grid_;
  double poisson_;
  ForwardOptions options_;
  WorkTeam& team_;
  ForwardOperator stiffness_;
  ForwardWorker worker_;  ///< Auto: not chosen yet
  gpu::Context* context_ = nullptr;
  std::shared_ptr<const ForwardKernels> kernels_;
  std::unique_ptr<ForwardSolver> processor_;
  std::unique_ptr<ForwardDevice> device_;
  std::string who_;
};

}  // namespace palpate
