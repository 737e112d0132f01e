#include "engine/numeric/matching/warp.h"

#include <algorithm>
#include <cmath>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Correlation length of warps over the template's RMS radius: by marginal likelihood of bent and of noisy
// shapes 1.0 to 1.4 alike.
constexpr double kLength = 1.2;
constexpr Index kLandmarks = 120, kModes = 40;
// Modes that add less than this fraction of the strongest one's variance are rounding errors.
constexpr double kLeastMode = 1e-9;

MatrixXd kernel(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd k = dense::product_nt(-2, a, b);
  k.colwise() += a.rowwise().squaredNorm();
  k.rowwise() += b.rowwise().squaredNorm().transpose();
  return (k.cwiseMax(0) * (-0.5 / (kLength * kLength))).array().exp();
}

}  // namespace

MatrixXd with_ones(const MatrixXd& points) {
  MatrixXd p(points.rows(), points.cols() + 1);
  p.col(0).setOnes();
  p.rightCols(points.cols()) = points;
  return p;
}

std::vector<Index> spread_subset(const MatrixXd& points, Index count) {
  const Index n = points.rows();
  VectorXd distance = (points.rowwise() - points.colwise().mean()).rowwise().squaredNorm();
  std::vector<Index> chosen;
  for (Index k = 0; k < std::min(count, n); ++k) {
    Index farthest = 0;
    distance.maxCoeff(&farthest);
    if (k > 0 && distance[farthest] <= 0) break;  // the rest are duplicates
    chosen.push_back(farthest);
    const VectorXd to_it = (points.rowwise() - points.row(farthest)).rowwise().squaredNorm();
    distance = k == 0 ? to_it : distance.cwiseMin(to_it);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

WarpModes::WarpModes(const MatrixXd& points) {
  const std::vector<Index> chosen = spread_subset(points, kLandmarks);
  landmarks_ = points(chosen, Eigen::all);
  // Modes contain no affine map. Points on a line or in a plane have fewer of those maps.
  const dense::ColumnSpace affine_maps = dense::column_space(with_ones(landmarks_), 1e-9);
  const Index left = landmarks_.rows() - affine_maps.rank;
  modes_.resize(landmarks_.rows(), 0);
  if (left <= 0) return;
  const MatrixXd free = affine_maps.q.rightCols(left);
  const dense::SymmetricEigen eigen =
      dense::symmetric_eigen(dense::product(dense::product_tn(free, kernel(landmarks_, landmarks_)), free));
  const VectorXd& variance = eigen.values;  // rising
  Index modes = 0;
  while (modes < std::min(left, kModes) && variance[left - 1 - modes] > kLeastMode * variance[left - 1])
    ++modes;
  modes_ = dense::product(free, eigen.vectors.rightCols(modes)) *
           variance.tail(modes).cwiseSqrt().cwiseInverse().asDiagonal();
}

MatrixXd WarpModes::basis(const MatrixXd& points) const {
  MatrixXd all(points.rows(), affine() + modes_.cols());
  all.leftCols(affine()) = with_ones(points);
  if (modes_.cols() > 0) all.rightCols(modes_.cols()) = dense::product(kernel(points, landmarks_), modes_);
  return all;
}

}  // namespace palpate
