#include "engine/numeric/matching/evidence.h"

#include <cmath>
#include <numbers>

#include "engine/numeric/dense.h"
#include "engine/numeric/matching/soft_partners.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Eigen::VectorXf;

constexpr Index kFolds = 5;

}  // namespace

double freedom_cost(const FlowProblem& problem, const FlowState& state, double amplitude) {
  const VectorXd weight = state.partners.rowwise().sum().cast<double>();
  VectorXd prior = VectorXd::Constant(problem.basis.cols(), amplitude);
  prior.head(problem.affine).setOnes();
  MatrixXd gram = (state.variance / prior.array()).matrix().asDiagonal();
  dense::add_square_tn(gram, weight.cwiseSqrt().asDiagonal() * problem.basis);
  const double narrower =
      dense::Cholesky(gram).lower().diagonal().array().log().sum() +
      0.5 * (prior.array().log().sum() - static_cast<double>(prior.size()) * std::log(state.variance));
  return narrower * static_cast<double>(problem.from.cols());
}

double held_out_gain(const FlowProblem& problem, const FlowState& state, double amplitude,
                     double energy_without) {
  const Index n = problem.from.rows(), m = problem.to.rows();
  const auto axes = static_cast<double>(problem.from.cols());
  const double outlier = state.outlier_fraction * std::exp(-problem.log_volume);
  double energy = 0;
  FlowState fitted;
  fitted.variance = state.variance;
  MatrixXf closeness;
  for (Index fold = 0; fold < kFolds; ++fold) {
    std::vector<Index> left, kept;
    for (Index j = 0; j < m; ++j) (j % kFolds == fold ? left : kept).push_back(j);
    const MatrixXf p = state.partners(Eigen::all, kept);
    const VectorXd spread =
        fit_warp(problem, p.rowwise().sum().cast<double>(),
                 dense::product(p, MatrixXf(problem.to(kept, Eigen::all))).cast<double>(), amplitude, fitted);
    const VectorXd variance = spread.array() + state.variance;
    set_closeness(fitted.warped, problem.to(left, Eigen::all), variance, {}, closeness);
    const VectorXf per = ((1 - state.outlier_fraction) / static_cast<double>(n) *
                          (2 * std::numbers::pi * variance.array()).pow(-0.5 * axes))
                             .cast<float>();
    const VectorXf likelihood = closeness.transpose() * per;
    for (Index j = 0; j < likelihood.size(); ++j)
      energy -= std::log(static_cast<double>(likelihood[j]) + outlier);
  }
  return (energy_without - energy) / static_cast<double>(m);
}

}  // namespace palpate
