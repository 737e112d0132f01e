#include "engine/numeric/matching/symmetry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/numeric/dense.h"
#include "engine/numeric/matching/spacing.h"
#include "engine/numeric/matching/warp.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

// Shares of the points' spacing: how far a point may come to lie from the next one, in the mean, and how well
// the points that a turn is made from must fit.
constexpr double kMostMiss = 0.25, kMostFrameMiss = 0.5;
constexpr size_t kMostTried = 2000;
constexpr Index kFirstLook = 12;

MatrixXd whitened(const MatrixXd& points) {
  const MatrixXd centred = points.rowwise() - points.colwise().mean();
  const dense::SymmetricEigen spread =
      dense::symmetric_eigen(dense::product_tn(centred, centred) / static_cast<double>(points.rows()));
  const double least = 1e-6 * spread.values.maxCoeff();
  return dense::product(centred, spread.vectors) *
         spread.values.cwiseMax(least).cwiseSqrt().cwiseInverse().asDiagonal();
}

// Orthonormal rows along p, then across it along q; with a third one to either side in space.
bool frame(const RowVectorXd& p, const RowVectorXd& q, double side, MatrixXd& rows) {
  const Index axes = p.size();
  rows.resize(axes, axes);
  if (!(p.norm() > 1e-9)) return false;
  rows.row(0) = p.normalized();
  if (axes == 2) {
    rows.row(1) << -side * rows(0, 1), side * rows(0, 0);
    return true;
  }
  const RowVectorXd across = q - q.dot(rows.row(0)) * rows.row(0);
  if (!(across.norm() > 1e-9)) return false;
  rows.row(1) = across.normalized();
  rows.row(2) << rows(0, 1) * rows(1, 2) - rows(0, 2) * rows(1, 1),
      rows(0, 2) * rows(1, 0) - rows(0, 0) * rows(1, 2), rows(0, 0) * rows(1, 1) - rows(0, 1) * rows(1, 0);
  rows.row(2) *= side;
  return true;
}

class SelfMaps {
 public:
  explicit SelfMaps(const MatrixXd& points)
      : points_(whitened(points)),
        spacing_(median_spacing(points_)),
        order_(spread_subset(points_, kFirstLook)) {
    first_ = order_.empty() ? 0 : order_.front();
    (points_.rowwise().squaredNorm()).maxCoeff(&first_);
    VectorXd across = points_.rowwise().squaredNorm();
    const RowVectorXd along = points_.row(first_).normalized();
    across -= (points_ * along.transpose()).cwiseAbs2();
    across.maxCoeff(&second_);
  }

  std::vector<std::vector<Index>> find(bool reflections, size_t most) {
    const Index n = points_.rows();
    const bool space = points_.cols() > 2;
    size_t tried = 0;
    for (Index a = 0; a < n; ++a) {
      if (!same_length(first_, a)) continue;
      for (Index b = 0; b < (space ? n : 1); ++b) {
        if (space && !(same_length(second_, b) &&
                       std::abs((points_.row(a) - points_.row(b)).norm() -
                                (points_.row(first_) - points_.row(second_)).norm()) < reach()))
          continue;
        for (const double side : {1., -1.}) {
          if (side < 0 && !reflections) continue;
          if (found_.size() >= most || ++tried > kMostTried) return found_;
          try_turn(a, b, side);
        }
      }
    }
    return found_;
  }

 private:
  double reach() const { return kMostFrameMiss * spacing_; }
  bool same_length(Index p, Index q) const {
    return std::abs(points_.row(p).norm() - points_.row(q).norm()) < reach();
  }

  Index nearest(const RowVectorXd& place, double& distance) const {
    Index at = 0;
    distance = std::sqrt((points_.rowwise() - place).rowwise().squaredNorm().minCoeff(&at));
    return at;
  }

  void try_turn(Index a, Index b, double side) {
    MatrixXd before, after;
    if (!frame(points_.row(first_), points_.row(second_), 1, before) ||
        !frame(points_.row(a), points_.row(b), side, after))
      return;
    const MatrixXd placed = dense::product(points_, dense::product_tn(before, after));
    double miss = 0, sum = 0;
    for (const Index i : order_) {
      nearest(placed.row(i), miss);
      sum += miss;
    }
    if (sum > 2 * kMostMiss * spacing_ * static_cast<double>(order_.size())) return;
    const Index n = points_.rows();
    std::vector<Index> map(static_cast<size_t>(n));
    sum = 0;
    double moved = 0;
    for (Index i = 0; i < n; ++i) {
      map[static_cast<size_t>(i)] = nearest(placed.row(i), miss);
      sum += miss;
      moved += (points_.row(map[static_cast<size_t>(i)]) - points_.row(i)).norm();
    }
    if (sum > kMostMiss * spacing_ * static_cast<double>(n) || moved < kOtherWarp * static_cast<double>(n))
      return;
    if (std::find(found_.begin(), found_.end(), map) == found_.end()) found_.push_back(std::move(map));
  }

  MatrixXd points_;
  double spacing_;
  std::vector<Index> order_;
  Index first_ = 0, second_ = 0;
  std::vector<std::vector<Index>> found_;
};

}  // namespace

std::vector<std::vector<Index>> self_maps(const MatrixXd& points, bool reflections, size_t most) {
  return SelfMaps(points).find(reflections, most);
}

}  // namespace palpate
