#include "engine/numeric/matching/flow.h"

#include <algorithm>
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

constexpr double kUnlikeOutlier = 0.3;         // how unlike an outlier's neighbourhood counts
constexpr double kTemplateNilFraction = 1e-3;  // before there is evidence
constexpr double kLeastOutlierFraction = 0.01;
constexpr double kLeastFoundFraction = 0.5;  // of the smaller set, while it is not settled
constexpr double kAffineCost = 1e-6;         // a hair: so that points on a line leave nothing singular
constexpr double kContextsUntilSd = 0.05;    // below it distance alone decides
constexpr float kLeastContextWeight = 0.05f;
constexpr Index kContextOthers = 300;  // more points than these are thinned as neighbours

MatrixXf thinned(const MatrixXf& points) {
  const Index step = (points.rows() + kContextOthers - 1) / kContextOthers;
  return points(Eigen::seqN(0, (points.rows() + step - 1) / step, step), Eigen::all);
}

VectorXf thinned_weight(const VectorXf& weight) {
  return thinned(weight).cwiseMax(kLeastContextWeight).cwiseMin(1.f);
}

}  // namespace

FlowProblem::FlowProblem(const MatrixXd& from_points, const WarpModes& modes, const MatrixXd& to_points,
                         double log_volume_, bool contexts)
    : from(from_points),
      basis(modes.basis(from_points)),
      affine(modes.affine()),
      to(to_points.cast<float>()),
      log_volume(log_volume_) {
  context_scale = std::max(mean_distance(to), 1e-6f);
  if (contexts) to_cells.emplace(to, thinned(to), context_scale);
}

VectorXd FlowProblem::cost() const {
  VectorXd all = VectorXd::Ones(basis.cols());
  all.head(affine).setConstant(kAffineCost);
  return all;
}

FlowProblem FlowProblem::stiff(Index modes) const {
  FlowProblem less = *this;
  const Index kept = std::min(modes, basis.cols() - affine);
  less.basis.resize(from.rows(), affine + kept);
  less.basis << basis.leftCols(affine), basis.rightCols(kept);
  return less;
}

void share_out(const FlowProblem& problem, FlowState& state, double unlike, VectorXf& row_factor) {
  const auto n = static_cast<double>(problem.from.rows()), m = static_cast<double>(problem.to.rows()),
             axes = static_cast<double>(problem.from.cols());
  const double spread =
      std::pow(2 * std::numbers::pi * state.variance, 0.5 * axes) * unlike * std::exp(-problem.log_volume);
  const double w = state.outlier_fraction, nil = std::max(kTemplateNilFraction, 1 - m / n);
  balance(static_cast<float>(w / (1 - w) * n * spread) + 1e-30f,
          static_cast<float>(nil / (1 - nil) * m * spread) + 1e-30f, row_factor, state.partners);
}

void set_partners(const FlowProblem& problem, FlowState& state) {
  const Index n = problem.from.rows();
  VectorXf row_factor = VectorXf::Ones(n);
  set_closeness(state.warped, problem.to, VectorXd::Constant(n, state.variance), {}, state.partners);
  share_out(problem, state, 1, row_factor);
}

double outlier_fraction(const FlowProblem& problem, double found) {
  const auto n = static_cast<double>(problem.from.rows()), m = static_cast<double>(problem.to.rows());
  return std::clamp(1 - found / m, kLeastOutlierFraction, 1 - kLeastFoundFraction * std::min(n, m) / m);
}

VectorXd fit_warp(const FlowProblem& problem, const VectorXd& weight, const MatrixXd& pull, double amplitude,
                  FlowState& state) {
  MatrixXd gram = ((state.variance / amplitude * problem.cost()).array() + 1e-12).matrix().asDiagonal();
  dense::add_square_tn(gram, weight.cwiseSqrt().asDiagonal() * problem.basis);
  const dense::Cholesky solver(gram);
  state.coefficients = solver.solve(dense::product_tn(problem.basis, pull));
  state.warped = dense::product(problem.basis, state.coefficients);
  const MatrixXd narrow = solver.solve_lower(MatrixXd(problem.basis.transpose()));
  return state.variance * narrow.colwise().squaredNorm().transpose();
}

void flow(const FlowProblem& problem, const FlowStage& stage, FlowState& state) {
  const Index n = problem.from.rows(), m = problem.to.rows(), axes = problem.from.cols();
  const VectorXd to_squares = problem.to.rowwise().squaredNorm().cast<double>();
  const bool contexts = stage.context_weight > 0 && problem.to_cells;
  const double unlike = contexts ? std::exp(-stage.context_weight * kUnlikeOutlier) : 1;
  const VectorXd cost = problem.cost();
  MatrixXf likeness, &p = state.partners;
  VectorXf row_factor = VectorXf::Ones(n);
  state.variance = stage.sd * stage.sd;
  state.converged = false;
  for (uint32_t k = 0; k < stage.most_iterations; ++k, ++state.iterations) {
    if (contexts && k == 0 && stage.likeness) {
      likeness = (stage.likeness->array() - 1) * static_cast<float>(stage.context_weight);
    } else if (contexts && k % stage.context_every == 0 &&
               (k == 0 || state.variance > kContextsUntilSd * kContextsUntilSd)) {
      VectorXf from_weight = VectorXf::Ones(n), to_weight = VectorXf::Ones(m);
      if (k > 0) {
        from_weight = p.rowwise().sum();
        to_weight = p.colwise().sum().transpose();
      }
      const MatrixXf at = state.warped.cast<float>(), others = thinned(at);
      const float scale = k > 0 ? problem.context_scale : std::max(mean_distance(at), 1e-6f);
      likeness = dense::product_tn(ContextCells(at, others, scale).histograms(thinned_weight(from_weight)),
                                   problem.to_cells->histograms(thinned_weight(to_weight)));
      likeness = (likeness.array() - 1) * static_cast<float>(stage.context_weight);
    }
    set_closeness(state.warped, problem.to, VectorXd::Constant(n, state.variance), likeness, p);
    share_out(problem, state, unlike, row_factor);

    const VectorXd weight = p.rowwise().sum().cast<double>();
    const MatrixXd pull = dense::product(p, problem.to).cast<double>();
    const double found = weight.sum();
    const MatrixXd weighted = weight.cwiseSqrt().asDiagonal() * problem.basis;
    const VectorXd ridge = (state.variance / stage.amplitude * cost).array() + 1e-12 * static_cast<double>(n);
    MatrixXd gram = ridge.asDiagonal();
    dense::add_square_tn(gram, weighted);
    const dense::Cholesky solver(gram);
    state.coefficients = solver.solve(dense::product_tn(problem.basis, pull));
    state.warped = dense::product(problem.basis, state.coefficients);

    const double squares = p.colwise().sum().transpose().cast<double>().dot(to_squares) -
                           2 * state.warped.cwiseProduct(pull).sum() +
                           weight.dot(state.warped.rowwise().squaredNorm());
    double freedom = 0;
    if (stage.count_freedom) {
      const MatrixXd inverse = solver.solve_lower(MatrixXd(ridge.cwiseSqrt().asDiagonal()));
      freedom = std::min(static_cast<double>(ridge.size()) - inverse.squaredNorm(), 0.8 * found);
    }
    const double old = state.variance;
    state.outlier_fraction = outlier_fraction(problem, found);
    state.variance = std::max(squares, 0.0) / (static_cast<double>(axes) * std::max(found - freedom, 1.0));
    state.variance = std::clamp(state.variance, stage.cooling * old, 1.2 * old);
    state.variance = std::max(state.variance, kLeastSd * kLeastSd);
    if (k > 8 && std::abs(state.variance - old) < 1e-3 * old) {
      state.converged = true;
      ++state.iterations;
      break;
    }
  }
}

void weigh(const FlowProblem& problem, double amplitude, FlowState& state) {
  MatrixXf p;
  set_closeness(state.warped, problem.to, VectorXd::Constant(problem.from.rows(), state.variance), {}, p);
  const Eigen::RowVectorXf sums = p.colwise().sum();
  const double per =
      (1 - state.outlier_fraction) / static_cast<double>(problem.from.rows()) /
      std::pow(2 * std::numbers::pi * state.variance, 0.5 * static_cast<double>(problem.from.cols()));
  const double outlier = state.outlier_fraction * std::exp(-problem.log_volume);
  state.bending = state.coefficients.bottomRows(state.coefficients.rows() - problem.affine).squaredNorm() /
                  (2 * amplitude);
  state.energy = state.bending;
  for (Index j = 0; j < sums.size(); ++j)
    state.energy -= std::log(per * static_cast<double>(sums[j]) + outlier);
}

}  // namespace palpate
