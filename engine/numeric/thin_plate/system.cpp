#include "engine/numeric/thin_plate/system.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
/// Share of the plain score in the robust one, score x (share + (1 - share) tr A^2 / n) (Lukas 2006). The
/// plain score has a second minimum that follows the noise in one of thirty fits or so, with gradients ten
/// times too rough; this share has not, and leaves fits of exact values as they are.
constexpr double kPlain = 0.4;
constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

Eigen::MatrixXd polynomial_of(uint32_t axes, const std::vector<double>& at, Eigen::Index points) {
  Eigen::MatrixXd p(points, 1 + axes);
  p.col(0).setOnes();
  for (uint32_t a = 0; a < axes; ++a)
    p.col(1 + a) = Eigen::Map<const Eigen::VectorXd>(at.data() + a * points, points);
  return p;
}

}  // namespace

PlateSystem::PlateSystem(PlateKernel kernel, uint32_t axes, const std::vector<double>& at,
                         const std::vector<double>& weight)
    : points_(static_cast<Eigen::Index>(weight.size())),
      terms_(1 + axes),
      root_(Eigen::Map<const Eigen::VectorXd>(weight.data(), points_).cwiseSqrt()),
      polynomial_(root_.asDiagonal() * polynomial_of(axes, at, points_)) {
  kernel_.setZero(points_, points_);
  plate_matrix(kernel, axes, at, weight.size(), {kernel_.data(), weight.size() * weight.size()});
  kernel_ = root_.asDiagonal() * kernel_ * root_.asDiagonal();
  const Eigen::MatrixXd turned = polynomial_.times_q(polynomial_.qt_times(kernel_));
  const Eigen::Index left = points_ - terms_;
  free_ = turned.bottomRightCorner(left, left);
}

PlateSystem::Tridiagonal::Tridiagonal(const Eigen::MatrixXd& matrix)
    : form(matrix), eigenvalues(form.eigenvalues().cwiseMax(0.0)) {}

Eigen::MatrixXd PlateSystem::Tridiagonal::solve(const Eigen::MatrixXd& right, double lambda) const {
  const Eigen::VectorXd &diagonal = form.diagonal(), &side = form.side();
  const Eigen::Index n = diagonal.size();
  Eigen::VectorXd inverse(n), factor(n);
  // Rounding may leave the least pivots at or below 0 where lambda is: no pivot is below what rounding
  // leaves.
  const double least = kEpsilon * (eigenvalues.maxCoeff() + lambda);
  for (Eigen::Index i = 0; i < n; ++i) {
    double pivot = diagonal[i] + lambda;
    factor[i] = i > 0 ? side[i - 1] * inverse[i - 1] : 0;
    if (i > 0) pivot -= factor[i] * side[i - 1];
    inverse[i] = 1 / std::max(pivot, least);
  }
  Eigen::MatrixXd x = right;
  for (Eigen::Index column = 0; column < x.cols(); ++column) {
    double* const to = x.data() + column * n;
    for (Eigen::Index i = 1; i < n; ++i) to[i] -= factor[i] * to[i - 1];
    to[n - 1] *= inverse[n - 1];
    for (Eigen::Index i = n - 2; i >= 0; --i) to[i] = (to[i] - side[i] * to[i + 1]) * inverse[i];
  }
  return x;
}

void PlateSystem::factor(double lambda) {
  if (asked_ == lambda) return;
  asked_ = factored_ = lambda;
  inverse_trace_ = -1;
  const auto attempt = [&] {
    Eigen::MatrixXd matrix = free_;
    matrix.diagonal().array() += factored_;
    cholesky_.emplace(matrix);
    return cholesky_->ok();
  };
  if (attempt()) return;
  // Rounding has made the matrix indefinite: the least lambda that it carries.
  factored_ = kEpsilon * static_cast<double>(points_) * free_.trace();
  while (!attempt()) factored_ *= 10;
}

Eigen::MatrixXd PlateSystem::reduced(const Eigen::MatrixXd& right, double lambda) {
  if (!tridiagonal_) {
    factor(lambda);
    return cholesky_->solve(right);
  }
  const dense::Tridiagonal& form = tridiagonal_->form;
  return form.q_times(tridiagonal_->solve(form.qt_times(right), lambda));
}

PlateSystem::Solution PlateSystem::solve(const Eigen::MatrixXd& values, double lambda, bool spread) {
  Solution s;
  s.lambda = lambda;
  const Eigen::Index left = points_ - terms_;
  const Eigen::MatrixXd white = root_.asDiagonal() * values;
  Eigen::MatrixXd turned = polynomial_.qt_times(white);
  Eigen::MatrixXd w = Eigen::MatrixXd::Zero(points_, values.cols());
  s.freedom = static_cast<double>(points_);
  if (left > 0) {
    // The tridiagonal form has no way of raising a lambda that is too small.
    if (tridiagonal_ && lambda < kEpsilon * tridiagonal_->eigenvalues.sum()) tridiagonal_.reset();
    w.bottomRows(left) = reduced(turned.bottomRows(left), lambda);
    if (tridiagonal_) {
      const auto& d = tridiagonal_->eigenvalues;
      s.condition = (d.maxCoeff() + lambda) / (d.minCoeff() + lambda);
      s.freedom -= (lambda / (d.array() + lambda)).sum();
    } else {
      s.lambda = factored_;
      s.raised = factored_ != lambda;
      s.condition = 1 / cholesky_->rcond();
      if (s.lambda > 0 && spread && inverse_trace_ < 0)
        inverse_trace_ = cholesky_->solve_lower(Eigen::MatrixXd::Identity(left, left)).squaredNorm();
      if (s.lambda > 0) s.freedom = spread ? s.freedom - s.lambda * inverse_trace_ : kNotKnown;
    }
    w = polynomial_.q_times(w);
  }
  s.chi_square = s.lambda * s.lambda * w.colwise().squaredNorm().transpose();
  turned = polynomial_.qt_times(dense::minus_product(white, kernel_, w));
  s.polynomial = polynomial_.solve_r(turned.topRows(terms_));
  s.weight = root_.asDiagonal() * w;
  return s;
}

PlateSystem::Choice PlateSystem::choose(const Eigen::MatrixXd& values, double within, size_t averaged) {
  const Eigen::Index left = points_ - terms_;
  if (left == 0) return {0, kNotKnown};
  if (!tridiagonal_) tridiagonal_.emplace(free_);
  const Eigen::MatrixXd white = root_.asDiagonal() * values;
  const Eigen::MatrixXd turned = polynomial_.qt_times(white);
  const Eigen::MatrixXd seen = tridiagonal_->form.qt_times(turned.bottomRows(left));
  const double widest = std::max(tridiagonal_->eigenvalues.maxCoeff(), std::numeric_limits<double>::min());
  // Rounding of the values counts as chi-square, so that none of it is followed.
  const double rounding = std::pow(16 * kEpsilon, 2) * white.squaredNorm();
  const double all = static_cast<double>(points_) + static_cast<double>(averaged);
  double plain = 0;  // of the last score
  const auto score = [&](double log_lambda) {
    const double lambda = std::exp(log_lambda);
    const auto& d = tridiagonal_->eigenvalues.array();
    const double chi_square = lambda * lambda * tridiagonal_->solve(seen, lambda).squaredNorm();
    const double taken = (lambda / (d + lambda)).sum();
    plain = all * (chi_square + within + rounding) / std::pow(taken + static_cast<double>(averaged), 2);
    const double followed = static_cast<double>(terms_) + (d / (d + lambda)).square().sum();
    return plain * (kPlain + (1 - kPlain) * followed / all);
  };
  // From the stiffest down: of equal scores the stiffest is kept.
  const double step = std::log(10.0) / 4, top = std::log(widest) + 24 * step;
  const double bottom = std::log(4 * kEpsilon * tridiagonal_->eigenvalues.sum());
  double best = top, least = score(top);
  for (double at = top - step; at >= bottom; at -= step)
    if (const double s = score(at); s < least * (1 - 1e-9)) best = at, least = s;
  double low = std::max(best - step, bottom), high = best + step;
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double a = high - golden * (high - low), b = low + golden * (high - low), at_a = score(a), at_b = score(b);
  for (int i = 0; i < 20; ++i) {
    if (at_a < at_b) {
      high = b, b = a, at_b = at_a, a = high - golden * (high - low), at_a = score(a);
    } else {
      low = a, a = b, at_a = at_b, b = low + golden * (high - low), at_b = score(b);
    }
  }
  const double inner = 0.5 * (low + high), at_inner = score(inner);
  const double chosen = at_inner < least ? inner : best;
  static_cast<void>(score(chosen));
  return {std::exp(chosen), plain};
}

Eigen::VectorXd PlateSystem::row(const Eigen::VectorXd& kernel, const Eigen::VectorXd& polynomial,
                                 double lambda) {
  const Eigen::Index left = points_ - terms_;
  Eigen::VectorXd g = Eigen::VectorXd::Zero(points_);
  g.head(terms_) = polynomial_.solve_rt(polynomial);
  g = polynomial_.q_times(g);
  if (left > 0) {
    const Eigen::VectorXd rest =
        polynomial_.qt_times(dense::minus_product(root_.asDiagonal() * kernel, kernel_, g));
    Eigen::VectorXd more = Eigen::VectorXd::Zero(points_);
    more.tail(left) = reduced(rest.tail(left), lambda);
    g += polynomial_.q_times(more);
  }
  return root_.asDiagonal() * g;
}

}  // namespace palpate
