#include "perf/lab/rivals/forward_rival.h"

#include <algorithm>

#include "palpate/error.h"

namespace palpate::perf {
namespace {

constexpr double kPoisson = 0.495, kResidual = 1e-6;
constexpr uint32_t kMostIterations = 2000;

fem::CellGrid block(uint32_t along) {
  fem::Scene scene;
  scene.poisson = kPoisson;
  scene.cells = {along, along, along / 2};
  return voxelise(scene, false);
}

fem::FixedNodes plate_and_floor(const fem::CellGrid& grid) {
  fem::FixedNodes fixed(grid.nodes());
  std::fill_n(fixed.begin(), grid.node(0, 0, 1), uint8_t{fem::kFixedZ});
  std::fill(fixed.begin() + static_cast<std::ptrdiff_t>(grid.node(0, 0, grid.cells[2])), fixed.end(),
            uint8_t{fem::kFixedX | fem::kFixedY | fem::kFixedZ});
  return fixed;
}

}  // namespace

ForwardRival::ForwardRival(gpu::Context& context, uint32_t along)
    : grid_(block(along)),
      fixed_(plate_and_floor(grid_)),
      team_(0),
      processor_(grid_, kPoisson, fixed_, team_),
      multigrid_(grid_, kPoisson, fixed_, team_),
      device_(context, grid_, kPoisson, fixed_),
      single_(3 * grid_.nodes()),
      single_force_(single_.size()),
      load_(single_.size()),
      start_(single_.size()),
      displacement_(single_.size()),
      force_(single_.size()) {
  std::fill_n(start_.begin() + static_cast<std::ptrdiff_t>(2 * grid_.nodes()), grid_.node(0, 0, 1), 1.0);
  // A field with something in it everywhere, also on the device, which works on what it holds.
  displacement_ = start_;
  device_.solve(load_, displacement_, kResidual, 4);
  std::copy(displacement_.begin(), displacement_.end(), single_.begin());
  device_.precondition(single_.data(), single_force_.data());
}

std::string ForwardRival::size() const {
  return std::to_string(grid_.cells[0]) + "x" + std::to_string(grid_.cells[1]) + "x" +
         std::to_string(grid_.cells[2]);
}

Pair ForwardRival::product(int repetitions, int inner) {
  return compare(
      "forward product", size(), {"device", [&] { device_.run(fem::DeviceSolver::Piece::Product); }},
      {"processor",
       [&] { processor_.stiffness().apply(single_.data(), single_force_.data(), &fixed_, team_); }},
      repetitions, inner);
}

Pair ForwardRival::wide_product(int repetitions, int inner) {
  return compare("forward product double", size(),
                 {"device", [&] { device_.run(fem::DeviceSolver::Piece::WideProduct); }},
                 {"processor",
                  [&] { processor_.stiffness().apply(displacement_.data(), force_.data(), &fixed_, team_); }},
                 repetitions, inner);
}

Pair ForwardRival::cycle(int repetitions, int inner) {
  return compare("forward cycle", size(), {"device", [&] { device_.run(fem::DeviceSolver::Piece::Cycle); }},
                 {"processor", [&] { multigrid_.precondition(single_.data(), single_force_.data()); }},
                 repetitions, inner);
}

Pair ForwardRival::solve(int repetitions) {
  const auto checked = [](const fem::SolveStatistics& statistics) {
    if (!statistics.converged)
      throw Error(Failure::Device, "a solve that converges", std::to_string(statistics.residual),
                  "another device");
    return statistics.iterations;
  };
  return compare(
      "forward solve", size(),
      {"device",
       [&] {
         displacement_ = start_;
         device_iterations_ = checked(device_.solve(load_, displacement_, kResidual, kMostIterations));
       }},
      {"processor",
       [&] {
         displacement_ = start_;
         processor_iterations_ = checked(processor_.solve(load_, displacement_, kResidual, kMostIterations));
       }},
      repetitions, 1);
}

}  // namespace palpate::perf
