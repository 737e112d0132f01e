#include "engine/numeric/matching/start.h"

#include <algorithm>
#include <array>
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

// The 24 turns of a cube onto itself, and those that bring principal axes together.
std::vector<MatrixXd> turns_in_space(const MatrixXd& from, const MatrixXd& to) {
  std::vector<MatrixXd> all;
  std::array<int, 3> axis{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      MatrixXd turn = MatrixXd::Zero(3, 3);
      for (int c = 0; c < 3; ++c) turn(c, axis[static_cast<size_t>(c)]) = (signs >> c) & 1 ? -1 : 1;
      const bool about_last = axis[2] == 2 && (signs >> 2) == 0;  // tried anyway
      if (dense::determinant(turn) > 0 && !about_last) all.push_back(std::move(turn));
    }
  } while (std::next_permutation(axis.begin(), axis.end()));
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

MatrixXd mirror(Index axes) {
  MatrixXd m = MatrixXd::Identity(axes, axes);
  m(0, 0) = -1;
  return m;
}

}  // namespace

double angle_of(const MatrixXd& turn) {
  const MatrixXd rotation = dense::determinant(turn) < 0 ? dense::product(mirror(turn.rows()), turn) : turn;
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

// The similarity from `a` to `b`, row by row with weights; `turn` is the rotation for rows, `mirrored` or
// not.
void fit_similarity(const MatrixXd& a, const MatrixXd& b, const VectorXd& weight, bool mirrored,
                    MatrixXd& turn, double& scale, RowVectorXd& shift) {
  const double total = weight.sum();
  const RowVectorXd ca = weight.transpose() * a / total, cb = weight.transpose() * b / total;
  const MatrixXd x = a.rowwise() - ca, y = b.rowwise() - cb;
  dense::Svd svd = dense::svd(dense::product(x.transpose() * weight.asDiagonal(), y),
                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  turn = dense::product_nt(svd.u, svd.v);
  if ((dense::determinant(turn) < 0) != mirrored) {
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
  const bool mirrored = dense::determinant(votes_[k].turn) < 0;
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
    fit_similarity(a, b, weight, mirrored, turn, scale, shift);
    VectorXd miss = ((dense::product(scale, a, turn).rowwise() + shift) - b).rowwise().squaredNorm();
    const double usual = std::max(median(std::vector<double>(miss.begin(), miss.end())), 1e-12);
    weight = (1 + miss.array() / usual).inverse();
  }
  return {dense::product(scale, from_, turn).rowwise() + shift, angle_of(turn)};
}

Votes::Votes(const MatrixXd& from, const MatrixXd& to, bool reflections)
    : from_(from), centres_(thinned(from, kVoters)), targets_(thinned(to, 2 * kVoters)) {
  thinned_ = centres_.rows() < from.rows() || targets_.rows() < to.rows();
  const MatrixXd others = thinned(from, 2 * kVoters);
  const MatrixXf wanted = seen_from(targets_, targets_);
  const auto vote = [&](const MatrixXd& turn, const MatrixXf& seen) {
    MatrixXf likeness = dense::product_tn(seen, wanted);
    const double rows = likeness.rowwise().maxCoeff().mean(), columns = likeness.colwise().maxCoeff().mean();
    votes_.push_back({turn, 2 - rows - columns, std::move(likeness)});
  };
  const Index axes = from.cols();
  for (const bool mirrored : {false, true}) {
    if (mirrored && !reflections) continue;
    const MatrixXd before = mirrored ? mirror(axes) : MatrixXd::Identity(axes, axes);
    const auto seen_after = [&](const MatrixXd& turn) {
      return seen_from(dense::product(centres_, turn), dense::product(others, turn));
    };
    const MatrixXf unturned = seen_after(before);
    for (int k = 0; k < kContextDirections; ++k)
      vote(dense::product(before, about_last_axis(axes, 2 * std::numbers::pi * k / kContextDirections)),
           turned(unturned, k));
    if (axes < 3) continue;
    for (const MatrixXd& turn : turns_in_space(dense::product(from, before), to)) {
      const MatrixXd whole = dense::product(before, turn);
      vote(whole, seen_after(whole));
    }
  }
  std::stable_sort(votes_.begin(), votes_.end(),
                   [](const Vote& a, const Vote& b) { return a.unlikeness < b.unlikeness; });
}

}  // namespace palpate
