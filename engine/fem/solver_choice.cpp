#include "engine/fem/solver_choice.h"

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

constexpr uint32_t kTrialIterations = 2;

template <typename Solver>
double trial_ms(Solver& solver, const std::vector<double>& load, std::vector<double> displacement) {
  const auto start = std::chrono::steady_clock::now();
  const SolveStatistics statistics = solver.solve(load, displacement, 0, kTrialIterations);
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return ms / std::max(1u, statistics.iterations);
}

}  // namespace

SolverChoice::SolverChoice(const CellGrid& grid, double poisson, const Options& options, WorkTeam& team)
    : grid_(grid),
      poisson_(poisson),
      options_(options),
      team_(team),
      stiffness_(grid, poisson),
      worker_(options.worker),
      who_("processor") {
  if (worker_ == Worker::Processor) return;
  if (worker_ == Worker::Device) {
    if (!options.device)
      throw Error(Failure::Device, "a device to solve on", "none given", "--solver processor");
    context_ = options.device();
    who_ = context_->report().name;
    return;
  }
  context_ = device_for_auto();
  if (context_ == nullptr) worker_ = Worker::Processor;
}

/// Null, with the reason in who_, where a device is passed over without trying it.
gpu::Context* SolverChoice::device_for_auto() {
  const auto pass_over = [&](const std::string& why) -> gpu::Context* {
    who_ = "processor (device passed over: " + why + ")";
    return nullptr;
  };
  if (!options_.device) return pass_over("none given");
  if (grid_.nodes() < kFewestForDevice)
    return pass_over(std::to_string(grid_.nodes()) + " nodes, fewer than " +
                     std::to_string(kFewestForDevice));
  if (const std::string why = DeviceCycle::refusal(grid_); !why.empty()) return pass_over(why);
  try {
    gpu::Context* context = options_.device();
    const std::string why = DeviceSolver::refusal(*context, grid_);
    return why.empty() ? context : pass_over(why);
  } catch (const Error& error) {
    if (error.failure() != Failure::Device) throw;
    return pass_over(error.what());
  }
}

void SolverChoice::hold(const FixedNodes& fixed) {
  if (worker_ != Worker::Device && !processor_)
    processor_ = std::make_unique<Solver>(grid_, poisson_, fixed, team_);
  if (worker_ != Worker::Processor && !device_) {
    device_ = std::make_unique<DeviceSolver>(*context_, grid_, poisson_, fixed, kernels_);
    kernels_ = device_->kernels();
  }
}

void SolverChoice::release() {
  processor_.reset();
  device_.reset();
}

void SolverChoice::choose(const std::vector<double>& load, const std::vector<double>& displacement) {
  device_->run(DeviceSolver::Piece::Iteration);  // some drivers compile a kernel when it first runs
  const double device_ms = trial_ms(*device_, load, displacement);
  const double processor_ms = trial_ms(*processor_, load, displacement);
  const bool faster = device_ms < processor_ms;
  const std::string name = context_->report().name;
  const std::string line = text("%s (%.3g ms an iteration; %s %.3g ms)", faster ? name.c_str() : "processor",
                                std::min(device_ms, processor_ms), faster ? "processor" : name.c_str(),
                                std::max(device_ms, processor_ms));
  who_ = line;
  worker_ = faster ? Worker::Device : Worker::Processor;
  if (faster) {
    processor_.reset();
  } else {
    device_.reset();
    kernels_.reset();
  }
}

SolveStatistics SolverChoice::solve(const std::vector<double>& load, std::vector<double>& displacement,
                                    double residual, uint32_t most_iterations) {
  if (worker_ == Worker::Auto) choose(load, displacement);
  return device_ ? device_->solve(load, displacement, residual, most_iterations)
                 : processor_->solve(load, displacement, residual, most_iterations);
}

void SolverChoice::forces(const std::vector<double>& displacement, std::vector<double>& force) {
  force.resize(displacement.size());
  stiffness_.apply(displacement.data(), force.data(), nullptr, team_);
}

uint64_t SolverChoice::bytes() const {
  return (processor_ ? processor_->bytes() : 0) + (device_ ? device_->bytes() : 0);
}

}  // namespace palpate::fem
