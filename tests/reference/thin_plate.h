// A thin-plate spline in its plainest form: the whole saddle system, solved with full pivoting.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "engine/numeric/thin_plate/kernel.h"

namespace palpate::reference {

inline double plate_value(PlateKernel kernel, double r) {
  if (kernel == PlateKernel::Log) return r > 0 ? r * r * std::log(r * r) : 0;
  return kernel == PlateKernel::Linear ? -r : r * r * r;
}

/// One field over the points as they stand: neither merged nor reduced; scaled only as lambda is defined.
template <size_t D>
class Plate {
 public:
  Plate(PlateKernel kernel, std::span<const std::array<double, D>> points, std::span<const double> values,
        double lambda, std::span<const double> weights = {})
      : kernel_(kernel), n_(static_cast<Eigen::Index>(points.size())), at_(n_, D) {
    for (Eigen::Index i = 0; i < n_; ++i)
      for (size_t d = 0; d < D; ++d) at_(i, static_cast<Eigen::Index>(d)) = points[static_cast<size_t>(i)][d];
    centre_ = at_.colwise().mean();
    at_.rowwise() -= centre_;
    scale_ = 1 / std::sqrt(at_.squaredNorm() / static_cast<double>(n_));
    at_ *= scale_;
    const Eigen::Index m = 1 + static_cast<Eigen::Index>(D);
    Eigen::MatrixXd s = Eigen::MatrixXd::Zero(n_ + m, n_ + m);
    double mean = 0;
    for (const double w : weights) mean += w / static_cast<double>(n_);
    for (Eigen::Index i = 0; i < n_; ++i) {
      for (Eigen::Index j = 0; j < n_; ++j) s(i, j) = plate_value(kernel, (at_.row(i) - at_.row(j)).norm());
      s(i, i) += weights.empty() ? lambda : lambda * mean / weights[static_cast<size_t>(i)];
      s(i, n_) = s(n_, i) = 1;
      for (Eigen::Index d = 0; d + 1 < m; ++d) s(i, n_ + 1 + d) = s(n_ + 1 + d, i) = at_(i, d);
    }
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n_ + m);
    for (Eigen::Index i = 0; i < n_; ++i) right[i] = values[static_cast<size_t>(i)];
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(s);
    solution_ = lu.solve(right);
    // Trace of the influence matrix I - lambda W^-1 (S^-1)_11.
    const Eigen::MatrixXd inverse = lu.inverse();
    freedom_ = static_cast<double>(n_);
    for (Eigen::Index i = 0; i < n_; ++i)
      freedom_ -=
          (weights.empty() ? lambda : lambda * mean / weights[static_cast<size_t>(i)]) * inverse(i, i);
  }

  double operator()(const std::array<double, D>& place) const {
    Eigen::RowVectorXd t(D);
    for (size_t d = 0; d < D; ++d) t[static_cast<Eigen::Index>(d)] = place[d];
    t = (t - centre_) * scale_;
    double sum = solution_[n_];
    for (Eigen::Index d = 0; d < static_cast<Eigen::Index>(D); ++d) sum += solution_[n_ + 1 + d] * t[d];
    for (Eigen::Index i = 0; i < n_; ++i) sum += solution_[i] * plate_value(kernel_, (t - at_.row(i)).norm());
    return sum;
  }
  double freedom() const { return freedom_; }

 private:
  PlateKernel kernel_;
  Eigen::Index n_;
  Eigen::MatrixXd at_;
  Eigen::RowVectorXd centre_;
  double scale_ = 1, freedom_ = 0;
  Eigen::VectorXd solution_;
};

/// One piece of degree 3 by 3 on the unit cell from value, slopes and mixed derivative at its corners (left
/// upper, right upper, left lower, right lower): value and both slopes at (x, y).
inline std::array<double, 3> hermite_piece(const std::array<std::array<double, 4>, 4>& corners, double x,
                                           double y) {
  const auto weight = [](int end, int order, double t) {  // of the value or the slope at an end
    if (order == 0) return end == 0 ? 2 * t * t * t - 3 * t * t + 1 : 3 * t * t - 2 * t * t * t;
    return end == 0 ? t * t * t - 2 * t * t + t : t * t * t - t * t;
  };
  const auto slope = [](int end, int order, double t) {
    if (order == 0) return end == 0 ? 6 * t * t - 6 * t : 6 * t - 6 * t * t;
    return end == 0 ? 3 * t * t - 4 * t + 1 : 3 * t * t - 2 * t;
  };
  std::array<double, 3> result{};
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i)
      for (int b = 0; b < 2; ++b)
        for (int a = 0; a < 2; ++a) {
          const double known = corners[static_cast<size_t>(2 * j + i)][static_cast<size_t>(2 * b + a)];
          result[0] += known * weight(i, a, x) * weight(j, b, y);
          result[1] += known * slope(i, a, x) * weight(j, b, y);
          result[2] += known * weight(i, a, x) * slope(j, b, y);
        }
  return result;
}

}  // namespace palpate::reference
