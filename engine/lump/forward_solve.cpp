#include "engine/lump/forward_solve.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

/// How often the recursion's residual is replaced by the true one before rounding is said to lead.
constexpr int kMostRounds = 4;
/// Grids with fewer nodes are not handed out.
constexpr size_t kFewestForTeam = 4000;

}  // namespace

ForwardSolver::ForwardSolver(const ForwardGrid& grid, double poisson, FixedNodes fixed, WorkTeam& team)
    : grid_(grid),
      fixed_(std::move(fixed)),
      team_(grid.nodes() < kFewestForTeam ? alone_ : team),
      multigrid_(grid, poisson, fixed_, team_) {
  const size_t n = 3 * grid.nodes();
  for (std::vector<double>* v : {&residual_, &direction_, &product_}) v->resize(n);
  single_residual_.resize(n);
  correction_.resize(n);
}

uint64_t ForwardSolver::bytes() const {
  return multigrid_.bytes() + residual_.size() * (3 * sizeof(double) + 2 * sizeof(float)) +
         grid_.young.size() * sizeof(float) + fixed_.size();
}

void ForwardSolver::forces(const std::vector<double>& displacement, std::vector<double>& force) {
  force.resize(displacement.size());
  stiffness().apply(displacement.data(), force.data(), nullptr, team_);
}

template <typename Real>
double ForwardSolver::dot(const std::vector<double>& a, const std::vector<Real>& b) {
  std::vector<double> sums(team_.members());
  team_.run([&](uint32_t part) {
    const auto [begin, end] = team_.share(static_cast<uint32_t>(a.size()), part);
    double lanes[8] = {};
    size_t n = begin;
    for (; n + 8 <= end; n += 8)
      for (size_t l = 0; l < 8; ++l) lanes[l] += a[n + l] * double{b[n + l]};
    for (; n < end; ++n) lanes[0] += a[n] * double{b[n]};
    for (const double lane : lanes) sums[part] += lane;
  });
  double sum = 0;
  for (const double s : sums) sum += s;
  return sum;
}

// residual_ = load - K displacement where displacements are free, 0 where fixed. Returns its norm.
double ForwardSolver::out_of_balance(const std::vector<double>& load,
                                     const std::vector<double>& displacement) {
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

SolveEvidence ForwardSolver::solve(const std::vector<double>& load, std::vector<double>& displacement,
                                   double residual, uint32_t most_iterations) {
  SolveEvidence evidence;
  for (int round = 0;; ++round) {
    double left = out_of_balance(load, displacement);
    evidence.residual = all_forces_ > 0 ? left / all_forces_ : 0;
    evidence.converged = evidence.residual <= residual;
    if (evidence.converged || round == kMostRounds || evidence.iterations >= most_iterations) return evidence;

    double previous = 0;
    while (left > 0.9 * residual * all_forces_ && evidence.iterations < most_iterations) {
      // The cycle works on numbers near 1 whatever the unit.
      const double scale = left / std::sqrt(static_cast<double>(residual_.size()));
      team_.run([&](uint32_t part) {
        const auto [begin, end] = team_.share(static_cast<uint32_t>(residual_.size()), part);
        for (size_t n = begin; n < end; ++n) single_residual_[n] = static_cast<float>(residual_[n] / scale);
      });
      multigrid_.precondition(single_residual_.data(), correction_.data());
      const double along = scale * dot(residual_, correction_);
      const double beta = previous == 0 ? 0 : along / previous;
      if (!(along > 0)) break;
      previous = along;
      team_.run([&](uint32_t part) {
        const auto [begin, end] = team_.share(static_cast<uint32_t>(residual_.size()), part);
        for (size_t n = begin; n < end; ++n)
          direction_[n] = scale * double{correction_[n]} + beta * direction_[n];
      });
      stiffness().apply(direction_.data(), product_.data(), &fixed_, team_);
      const double curvature = dot(direction_, product_);
      if (!(curvature > 0)) break;
      const double alpha = along / curvature;
      team_.run([&](uint32_t part) {
        const auto [begin, end] = team_.share(static_cast<uint32_t>(residual_.size()), part);
        for (size_t n = begin; n < end; ++n) {
          displacement[n] += alpha * direction_[n];
          residual_[n] -= alpha * product_[n];
        }
      });
      left = std::sqrt(dot(residual_, residual_));
      ++evidence.iterations;
    }
  }
}

}  // namespace palpate
