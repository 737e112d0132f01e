// The forward model's equations of one pressed block, on the device and on the processor.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/fem/device/solver.h"
#include "engine/fem/linear/solver.h"
#include "perf/measure.h"

namespace palpate::perf {

/// A flat plate on the whole block of tissue (40 x 40 x 20 mm, nu 0.495, a sphere of ten times the
/// stiffness), `along` x `along` x `along` / 2 cells, every core.
class ForwardRival {
 public:
  ForwardRival(gpu::Context& context, uint32_t along);

  std::string size() const;
  /// One product in single and in double precision, and one V-cycle.
  Pair product(int repetitions, int inner);
  Pair wide_product(int repetitions, int inner);
  Pair cycle(int repetitions, int inner);
  /// To a relative residual of 1e-6, with the solvers made.
  Pair solve(int repetitions);
  /// Iterations of the last solve on the device and on the processor.
  uint32_t device_iterations() const { return device_iterations_; }
  uint32_t processor_iterations() const { return processor_iterations_; }

 private:
  fem::CellGrid grid_;
  fem::FixedNodes fixed_;
  WorkTeam team_;
  fem::Solver processor_;
  fem::Multigrid multigrid_;
  fem::DeviceSolver device_;
  std::vector<float> single_, single_force_;
  std::vector<double> load_, start_, displacement_, force_;
  uint32_t device_iterations_ = 0, processor_iterations_ = 0;
};

}  // namespace palpate::perf
