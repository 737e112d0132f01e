#include "engine/numeric/matching/flow.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "engine/base/simd.h"
#include "engine/numeric/dense.h"

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
constexpr uint32_t kContextEvery = 5;
constexpr double kContextsUntilSd = 0.05;  // below it distance alone decides
constexpr float kLeastContextWeight = 0.05f;
constexpr Index kContextOthers = 300;  // more points than these are thinned as neighbours
constexpr int kBalancings = 2;

MatrixXf thinned(const MatrixXf& points) {
  const Index step = (points.rows() + kContextOthers - 1) / kContextOthers;
  return points(Eigen::seqN(0, (points.rows() + step - 1) / step, step), Eigen::all);
}

VectorXf thinned_weight(const VectorXf& weight) {
  return thinned(weight).cwiseMax(kLeastContextWeight).cwiseMin(1.f);
}

// e^x of x <= 0 to 3e-7 relative; below e^-87 nothing is left.
PALPATE_INLINE float fading(float x) {
  constexpr float kLog2e = 1.44269504f;
  const float t = std::max(x, -87.f) * kLog2e;
  const float whole = std::floor(t), f = t - whole;
  const float power =
      1.f + f * (0.693147f +
                 f * (0.2402265f + f * (0.0555033f + f * (0.0096184f + f * (0.0013341f + f * 0.000154f)))));
  return power * std::bit_cast<float>((static_cast<int32_t>(whole) + 127) << 23);
}

// One target's column: exp(-squared distance * scale + likeness). `a`: count x axes.
PALPATE_INLINE void fill_column(const float* a, size_t count, size_t axes, const float* b, float scale,
                                const float* likeness, float* result) {
  for (size_t i = 0; i < count; ++i) result[i] = 0;
  for (size_t c = 0; c < axes; ++c)
    for (size_t i = 0; i < count; ++i) {
      const float d = a[c * count + i] - b[c];
      result[i] += d * d;
    }
  if (likeness)
    for (size_t i = 0; i < count; ++i) result[i] = fading(likeness[i] - result[i] * scale);
  else
    for (size_t i = 0; i < count; ++i) result[i] = fading(-result[i] * scale);
}

using FillColumn = void (*)(const float*, size_t, size_t, const float*, float, const float*, float*);

void plain(const float* a, size_t count, size_t axes, const float* b, float scale, const float* likeness,
           float* result) {
  fill_column(a, count, axes, b, scale, likeness, result);
}
#ifdef PALPATE_WIDE
PALPATE_AVX2 void wide(const float* a, size_t count, size_t axes, const float* b, float scale,
                       const float* likeness, float* result) {
  fill_column(a, count, axes, b, scale, likeness, result);
}
#endif

FillColumn widest_here() {
#ifdef PALPATE_WIDE
  if (vector_units::avx2()) return wide;
#endif
  return plain;
}

// exp(-squared distance / (2 variance) + likeness); an empty likeness is none.
void set_closeness(const MatrixXd& from, const MatrixXf& to, double variance, const MatrixXf& likeness,
                   MatrixXf& result) {
  static const FillColumn fill = widest_here();
  const MatrixXf a = from.cast<float>();
  const auto scale = static_cast<float>(0.5 / variance);
  const auto count = static_cast<size_t>(a.rows()), axes = static_cast<size_t>(a.cols());
  result.resize(a.rows(), to.rows());
  for (Index j = 0; j < to.rows(); ++j) {
    const float b[3] = {to(j, 0), to(j, 1), axes > 2 ? to(j, 2) : 0.f};
    fill(a.data(), count, axes, b, scale, likeness.size() > 0 ? likeness.col(j).data() : nullptr,
         result.col(j).data());
  }
}

// The nil partners make the sets differ in what they share out: rows and columns each add up to 1 with their
// nil. Sinkhorn's iteration, warm from the last one.
void balance(float column_nil, float row_nil, VectorXf& row_factor, MatrixXf& p) {
  Eigen::RowVectorXf column_factor;
  for (int k = 0; k < kBalancings; ++k) {
    column_factor = ((row_factor.transpose() * p).array() + column_nil).inverse();
    row_factor = ((p * column_factor.transpose()).array() + row_nil).inverse();
  }
  column_factor = ((row_factor.transpose() * p).array() + column_nil).inverse();
  p.array().colwise() *= row_factor.array();
  p.array().rowwise() *= column_factor.array();
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

void flow(const FlowProblem& problem, const FlowStage& stage, FlowState& state) {
  const Index n = problem.from.rows(), m = problem.to.rows(), axes = problem.from.cols();
  const double smaller = static_cast<double>(std::min(n, m)), all_targets = static_cast<double>(m);
  const VectorXd to_squares = problem.to.rowwise().squaredNorm().cast<double>();
  const bool contexts = stage.context_weight > 0 && problem.to_cells;
  const double unlike = contexts ? std::exp(-stage.context_weight * kUnlikeOutlier) : 1;
  VectorXd cost = VectorXd::Ones(problem.basis.cols());
  cost.head(problem.affine).setConstant(kAffineCost);
  MatrixXf likeness, &p = state.partners;
  VectorXf row_factor = VectorXf::Ones(n);
  state.variance = stage.sd * stage.sd;
  state.converged = false;
  for (uint32_t k = 0; k < stage.most_iterations; ++k, ++state.iterations) {
    if (contexts && k % kContextEvery == 0 &&
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
    set_closeness(state.warped, problem.to, state.variance, likeness, p);
    const double spread = std::pow(2 * std::numbers::pi * state.variance, 0.5 * static_cast<double>(axes)) *
                          unlike * std::exp(-problem.log_volume);
    const double w = state.outlier_fraction;
    const double nil = std::max(kTemplateNilFraction, 1 - all_targets / static_cast<double>(n));
    balance(static_cast<float>(w / (1 - w) * static_cast<double>(n) * spread) + 1e-30f,
            static_cast<float>(nil / (1 - nil) * all_targets * spread) + 1e-30f, row_factor, p);

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
    state.outlier_fraction = std::clamp(1 - found / all_targets, kLeastOutlierFraction,
                                        1 - kLeastFoundFraction * smaller / all_targets);
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
  set_closeness(state.warped, problem.to, state.variance, {}, p);
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
