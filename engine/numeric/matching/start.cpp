#include "engine/numeric/matching/start.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/statistics.h"
#include "engine/numeric/assignment.h"
#include "engine/numeric/dense.h"
#include "engine/numeric/matching/contexts.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr int kTurns = 12;
constexpr int kReweightings = 10;
constexpr Index kVoters = 150;

MatrixXd thinned(const MatrixXd& points, Index most) {
  const Index step = (points.rows() + most - 1) / most;
  return points(Eigen::seqN(0, (points.rows() + step - 1) / step, step), Eigen::all);
}

MatrixXd about_last_axis(Index axes, double angle) {
  MatrixXd turn = MatrixXd::Identity(axes, axes);
  turn.topLeftCorner(2, 2) << std::cos(angle), std::sin(angle), -std::sin(angle), std::cos(angle);
  return turn;  // for rows: points * turn
}

MatrixXd principal_axes(const MatrixXd& points) {
  const MatrixXd centred = points.rowwise() - points.colwise().mean();
  return dense::symmetric_eigen(dense::product_tn(centred, centred)).vectors;
}

}  // namespace

std::vector<MatrixXd> starting_turns(const MatrixXd& from, const MatrixXd& to) {
  const Index axes = from.cols();
  std::vector<MatrixXd> all;
  all.reserve(kTurns + 4);
  for (int k = 0; k < kTurns; ++k) all.push_back(about_last_axis(axes, 2 * std::numbers::pi * k / kTurns));
  if (axes < 3) return all;
  const MatrixXd a = principal_axes(from), b = principal_axes(to);
  for (const double x : {1., -1.})
    for (const double y : {1., -1.}) {
      const auto turned = [&, x = x, y = y](double z) {
        return dense::product_nt(a * Eigen::Vector3d(x, y, z).asDiagonal(), b);
      };
      all.push_back(turned(dense::determinant(turned(1)) < 0 ? -1 : 1));
    }
  return all;
}

double angle_of(const MatrixXd& rotation) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  if (rotation.rows() == 2) return kDegrees * std::atan2(rotation(0, 1), rotation(0, 0));
  return kDegrees * std::acos(std::clamp(0.5 * (rotation.trace() - 1), -1., 1.));
}

namespace {

MatrixXf seen_from(const MatrixXd& centres, const MatrixXd& others) {
  const MatrixXf points = others.cast<float>();
  return ContextCells(centres.cast<float>(), points, std::max(mean_distance(points), 1e-6f))
      .histograms(Eigen::VectorXf::Ones(points.rows()));
}

// The similarity from `a` to `b`, row by row with weights; `turn` is the rotation for rows.
void fit_similarity(const MatrixXd& a, const MatrixXd& b, const VectorXd& weight, MatrixXd& turn,
                    double& scale, RowVectorXd& shift) {
  const double total = weight.sum();
  const RowVectorXd ca = weight.transpose() * a / total, cb = weight.transpose() * b / total;
  const MatrixXd x = a.rowwise() - ca, y = b.rowwise() - cb;
  dense::Svd svd = dense::svd(dense::product(x.transpose() * weight.asDiagonal(), y),
                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  turn = dense::product_nt(svd.u, svd.v);
  if (dense::determinant(turn) < 0) {
    svd.u.rightCols(1) *= -1;
    turn = dense::product_nt(svd.u, svd.v);
  }
  // By spreads, not by the cross terms: wrong partners would shrink it.
  scale = std::sqrt(weight.dot(y.rowwise().squaredNorm()) /
                    std::max(weight.dot(x.rowwise().squaredNorm()), 1e-30));
  shift = cb - scale * ca * turn;
}

}  // namespace

Placement Votes::place(size_t k) const {
  const MatrixXf& likeness = votes_[k].likeness;
  const bool across = centres_.rows() <= targets_.rows();
  const Index rows = across ? centres_.rows() : targets_.rows(),
              columns = across ? targets_.rows() : centres_.rows();
  std::vector<double> cost(static_cast<size_t>(rows * columns));
  for (Index i = 0; i < rows; ++i)
    for (Index j = 0; j < columns; ++j)
      cost[static_cast<size_t>(i * columns + j)] = 1 - double{across ? likeness(i, j) : likeness(j, i)};
  const std::vector<uint32_t> partner =
      assign(cost, static_cast<uint32_t>(rows), static_cast<uint32_t>(columns));
  const std::vector<Index> other(partner.begin(), partner.end());
  const MatrixXd a = across ? centres_ : MatrixXd(centres_(other, Eigen::all));
  const MatrixXd b = across ? MatrixXd(targets_(other, Eigen::all)) : targets_;
  VectorXd weight = VectorXd::Ones(rows);
  MatrixXd turn;
  double scale = 1;
  RowVectorXd shift;
  for (int round = 0; round <= kReweightings; ++round) {
    fit_similarity(a, b, weight, turn, scale, shift);
    VectorXd miss = ((dense::product(scale, a, turn).rowwise() + shift) - b).rowwise().squaredNorm();
    const double usual = std::max(median(std::vector<double>(miss.begin(), miss.end())), 1e-12);
    weight = (1 + miss.array() / usual).inverse();
  }
  return {dense::product(scale, from_, turn).rowwise() + shift, angle_of(turn)};
}

Votes::Votes(const MatrixXd& from, const MatrixXd& to)
    : from_(from), centres_(thinned(from, kVoters)), targets_(thinned(to, 2 * kVoters)) {
  const MatrixXd from_others = thinned(from, 2 * kVoters);
  const MatrixXf wanted = seen_from(targets_, targets_);
  for (const MatrixXd& turn : starting_turns(from, to)) {
    MatrixXf likeness = dense::product_tn(
        seen_from(dense::product(centres_, turn), dense::product(from_others, turn)), wanted);
    const double rows = likeness.rowwise().maxCoeff().mean(), columns = likeness.colwise().maxCoeff().mean();
    votes_.push_back({2 - rows - columns, std::move(likeness)});
  }
  unturned_ = votes_.front().unlikeness;
  std::stable_sort(votes_.begin(), votes_.end(),
                   [](const Vote& a, const Vote& b) { return a.unlikeness < b.unlikeness; });
}

}  // namespace palpate
