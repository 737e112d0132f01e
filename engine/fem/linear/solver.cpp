#include "engine/fem/linear/solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate::fem {

Solver::Solver(const CellGrid& grid, double poisson, FixedNodes fixed, WorkTeam& team)
    : grid_(grid),
      fixed_(std::move(fixed)),
      team_(grid.nodes() < kFewestForTeam ? alone_ : team),
      multigrid_(grid, poisson, fixed_, team_),
      gradients_(3 * grid.nodes(), team_) {
  const size_t n = 3 * grid.nodes();
  residual_.resize(n);
  product_.resize(n);
}

uint64_t Solver::bytes() const {
  return multigrid_.bytes() + gradients_.bytes() + 2 * residual_.size() * sizeof(double) +
         grid_.young.size() * sizeof(float) + fixed_.size();
}

void Solver::forces(const std::vector<double>& displacement, std::vector<double>& force) {
  force.resize(displacement.size());
  stiffness().apply(displacement.data(), force.data(), nullptr, team_);
}

// residual_ = load - K displacement where displacements are free, 0 where fixed. Returns its norm.
double Solver::out_of_balance(const std::vector<double>& load, const std::vector<double>& displacement) {
  forces(displacement, product_);
  const size_t nodes = grid_.nodes();
  double all = 0, open = 0;
  for (size_t c = 0; c < 3; ++c)
    for (size_t n = 0; n < nodes; ++n) {
      const size_t at = c * nodes + n;
      const bool held = (fixed_[n] >> c & 1) != 0;
      const double given = held ? product_[at] : load[at];
      all += given * given;
      residual_[at] = held ? 0 : load[at] - product_[at];
      open += residual_[at] * residual_[at];
    }
  all_forces_ = std::sqrt(all);
  return std::sqrt(open);
}

SolveStatistics Solver::solve(const std::vector<double>& load, std::vector<double>& displacement,
                              double residual, uint32_t most_iterations) {
  SolveStatistics statistics;
  for (int round = 0;; ++round) {
    const double left = out_of_balance(load, displacement);
    statistics.residual = all_forces_ > 0 ? left / all_forces_ : 0;
    statistics.converged = statistics.residual <= residual;
    if (statistics.converged || round == kMostRounds || statistics.iterations >= most_iterations)
      return statistics;

    statistics.iterations +=
        gradients_.run([this](const double* in, double* out) { stiffness().apply(in, out, &fixed_, team_); },
                       [this](const float* in, float* out) { multigrid_.precondition(in, out); }, residual_,
                       displacement, 0.9 * residual * all_forces_, most_iterations - statistics.iterations);
  }
}

}  // namespace palpate::fem
