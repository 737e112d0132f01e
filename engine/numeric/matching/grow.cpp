#include "engine/numeric/matching/grow.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/numeric/dense.h"
#include "engine/numeric/matching/soft_partners.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Eigen::VectorXf;

constexpr uint32_t kMostIterations = 25;
constexpr double kPullReach = 0.5;  // of the points' spacing: how uncertain a place may be and still pull
constexpr double kCooling = 0.7;
constexpr double kLeastWeight = 1e-6;

// Pull of its partners on each template point.
struct Pull {
  VectorXd weight;   // n
  MatrixXd mean;     // n x axes
  VectorXd scatter;  // n, per axis: of the partners about their mean
};

Pull pull_of(const FlowProblem& problem, const MatrixXf& partners) {
  Pull pull;
  pull.weight = partners.rowwise().sum().cast<double>();
  const VectorXd per = pull.weight.cwiseMax(1e-12).cwiseInverse();
  pull.mean = per.asDiagonal() * dense::product(partners, problem.to).cast<double>();
  const VectorXd squares = per.cwiseProduct((partners * problem.to.rowwise().squaredNorm()).cast<double>());
  pull.scatter =
      (squares - pull.mean.rowwise().squaredNorm()).cwiseMax(0) / static_cast<double>(problem.from.cols());
  return pull;
}

VectorXd squared_distance(const FlowProblem& problem, const FlowState& state, const Pull& pull) {
  return (state.warped - pull.mean).rowwise().squaredNorm() / static_cast<double>(problem.from.cols()) +
         pull.scatter;
}

}  // namespace

std::vector<Core> cores(const FlowProblem& problem, const FlowState& state, double amplitude, size_t most) {
  const Pull pull = pull_of(problem, state.partners);
  const Index n = problem.from.rows();
  const auto size = static_cast<size_t>(std::min<Index>(n, std::max<Index>(12, n / 6)));
  std::vector<Core> all;
  std::vector<std::pair<double, Index>> near(static_cast<size_t>(n));
  for (const Index seed : spread_subset(problem.from, 14)) {
    for (Index k = 0; k < n; ++k)
      near[static_cast<size_t>(k)] = {(problem.from.row(k) - problem.from.row(seed)).squaredNorm(), k};
    std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(size) - 1, near.end());
    Core core{VectorXd::Zero(n), 0};
    for (size_t k = 0; k < size; ++k) core.weight[near[k].second] = pull.weight[near[k].second];
    if (core.weight.sum() < 0.5 * static_cast<double>(size)) continue;
    FlowState fitted;
    fitted.variance = 0.25 * state.variance;
    fit_warp(problem, core.weight, core.weight.asDiagonal() * pull.mean, amplitude, fitted);
    const VectorXd squares = squared_distance(problem, fitted, pull);
    core.variance = core.weight.dot(squares) / core.weight.sum();
    all.push_back(std::move(core));
  }
  std::sort(all.begin(), all.end(), [](const Core& a, const Core& b) { return a.variance < b.variance; });
  all.resize(std::min(all.size(), most));
  return all;
}

void grow(const FlowProblem& problem, double amplitude, const Core& core, double spacing, FlowState& state) {
  Pull pull = pull_of(problem, state.partners);
  VectorXd weight = core.weight;
  const auto axes = static_cast<double>(problem.from.cols());
  const double reach = std::pow(kPullReach * spacing, 2);
  state.variance = std::max(core.variance, kLeastSd * kLeastSd);
  VectorXf row_factor = VectorXf::Ones(problem.from.rows());
  for (uint32_t k = 0; k < kMostIterations; ++k, ++state.iterations) {
    weight = weight.cwiseMax(kLeastWeight);
    const VectorXd spread = fit_warp(problem, weight, weight.asDiagonal() * pull.mean, amplitude, state);
    const VectorXd variance = spread.array() + state.variance;
    set_closeness(state.warped, problem.to, variance, {}, state.partners);
    const VectorXf share = (state.variance / variance.array()).pow(0.5 * axes).cast<float>();
    state.partners.array().colwise() *= share.array();
    share_out(problem, state, 1, row_factor);
    pull = pull_of(problem, state.partners);
    weight = pull.weight.array() * state.variance / (state.variance + pull.scatter.array()) /
             (1 + (spread.array() / reach).square());
    const double found = pull.weight.sum(), old = state.variance;
    state.outlier_fraction = outlier_fraction(problem, found);
    const VectorXd squares = squared_distance(problem, state, pull);
    state.variance =
        std::clamp(weight.dot(squares) / std::max(weight.sum(), 1e-12), kCooling * old, 1.2 * old);
    state.variance = std::max(state.variance, kLeastSd * kLeastSd);
  }
}

}  // namespace palpate
