#include "engine/motion/freedom.h"

#include <algorithm>
#include <cmath>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Twists = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Radians times the radius become radians.
Vector6d turns_by(double factor) {
  Vector6d scale;
  scale << 1, 1, 1, factor, factor, factor;
  return scale;
}

/// Orthonormal columns that span those of `twists`, but for what is nearly in the others: singular values of
/// no more than `least`.
Twists orthonormal(const MatrixXd& twists, double least = Freedom::kShare) {
  if (twists.cols() == 0) return Twists(6, 0);
  const dense::Svd parts = dense::svd(twists, Eigen::ComputeThinU);
  Eigen::Index rank = 0;
  while (rank < parts.values.size() && parts.values[rank] > least) ++rank;
  return parts.u.leftCols(rank);
}

/// The place x where shifts v and turns w (columns) leave the least, v + w x (x - at) = 0.
Vector3d still_place(const Twists& twists, const Vector3d& at) {
  MatrixXd left(3 * twists.cols(), 3);
  Eigen::VectorXd right(3 * twists.cols());
  for (Eigen::Index k = 0; k < twists.cols(); ++k) {
    left.middleRows<3>(3 * k) = cross(twists.col(k).tail<3>());
    right.segment<3>(3 * k) = -twists.col(k).head<3>();
  }
  return at + Vector3d(dense::shortest_solution(left, right));
}

/// What is unknown, in radians, so that each direction turns about an axis of its own, those first, or not at
/// all.
struct Turning {
  Twists twists;
  Eigen::Index turns = 0;
};
Turning turning_first(const Freedom& freedom) {
  constexpr double kNoTurn = 0.05;  // share of turning below which a direction is a shift
  const dense::Svd parts = dense::svd(freedom.unknown.bottomRows<3>(), Eigen::ComputeFullV);
  Turning out{.twists = turns_by(1 / freedom.radius_mm).asDiagonal() * (freedom.unknown * parts.v)};
  const Eigen::Index most = std::min<Eigen::Index>(freedom.unknown.cols(), 3);
  while (out.turns < most && parts.values[out.turns] > kNoTurn) ++out.turns;
  return out;
}

/// Names what its unknown directions are, and finds its axis.
void name(Freedom& freedom) {
  const Eigen::Index count = freedom.unknown.cols();
  if (count == 0) return;
  const auto [turned, turns] = turning_first(freedom);
  const Eigen::Index shifts = count - turns;
  freedom.kind = Slippage::Other;
  if (turns == 3 && shifts == 0) {
    freedom.kind = Slippage::Ball;
    freedom.pivot_mm = still_place(turned, freedom.at_mm);
    return;
  }
  if (turns == 0 && shifts == 1) {
    freedom.kind = Slippage::Extrusion;
    freedom.axis = turned.col(0).head<3>().normalized();
  }
  if (turns != 1) return;
  const Vector3d w = turned.col(0).tail<3>(), v = turned.col(0).head<3>();
  freedom.axis = w.normalized();
  if (shifts == 2) freedom.kind = Slippage::Plane;
  if (shifts > 1) return;
  const Vector3d along = freedom.axis * freedom.axis.dot(v);
  // The point of the axis next to `at`: w x (v - along) / |w|^2 from it.
  freedom.pivot_mm = freedom.at_mm + cross(w) * (v - along) / w.squaredNorm();
  constexpr double kParallel = 0.9;
  if (shifts == 1 && std::abs(turned.col(1).head<3>().normalized().dot(freedom.axis)) > kParallel)
    freedom.kind = Slippage::Cylinder;
  if (shifts == 0)
    freedom.kind =
        along.norm() > 0.015 * freedom.radius_mm * w.norm() ? Slippage::Screw : Slippage::Revolution;
}

}  // namespace

double Freedom::unknown_share(int component) const {
  const double share = unknown.row(component).norm();
  // A screw may have turned any number of times, and gone along its axis with each.
  return kind == Slippage::Screw && component < 3 ? std::max(share, std::abs(axis[component])) : share;
}

double Freedom::unknown_sd(int component, double roll_rad) const {
  if (unknown.cols() == 0) return 0;
  constexpr double kSpin_rad = 0.58;  // of all to 1
  // Amounts of the unknown directions whose turns are as likely as that.
  const Vector3d turns(1 / (roll_rad * roll_rad), 1 / (roll_rad * roll_rad), 1 / (kSpin_rad * kSpin_rad));
  const MatrixXd turning = unknown.bottomRows<3>();
  const MatrixXd precision =
      MatrixXd::Identity(unknown.cols(), unknown.cols()) + turning.transpose() * turns.asDiagonal() * turning;
  const Eigen::VectorXd row = unknown.row(component).transpose();
  const double square = row.dot(dense::Cholesky(precision).solve(row));
  return std::sqrt(std::max(square, 0.0)) * (component < 3 ? radius_mm : 1);
}

RigidMotion Freedom::least_turn(const RigidMotion& motion) const {
  RigidMotion out = motion;
  if (unknown.cols() == 0) return out;
  // Turns about the pivot itself may be of any size.
  const Vector3d place = has_pivot() ? pivot_mm : at_mm;
  const Freedom here = at(place);
  if (here.unknown.cols() == 0) return out;
  const Turning there = turning_first(here);
  if (there.turns == 0) return out;
  const Twists turning = there.twists.leftCols(there.turns);
  for (int step = 0; step < 3; ++step) {
    const MatrixXd left = turning.bottomRows<3>();
    const Vector6d twist = turning * dense::shortest_solution(left, Eigen::VectorXd(-turn_vector(out.turn)));
    out = motion_about(place, twist) * out;
  }
  return out;
}

Freedom Freedom::at(const Vector3d& place) const {
  Freedom out = *this;
  const Vector6d down = turns_by(1 / radius_mm), up = turns_by(radius_mm);
  // From however far it is seen, nothing that is unknown becomes known.
  constexpr double kAll = 1e-9;
  out.unknown = orthonormal(up.asDiagonal() * (seen_at(at_mm, place) * (down.asDiagonal() * unknown)), kAll);
  out.at_mm = place;
  return out;
}

Freedom Freedom::after(const RigidMotion& motion) const {
  Freedom out = *this;
  out.unknown = carried_by(motion) * unknown;
  out.at_mm = motion * at_mm;
  out.pivot_mm = motion * pivot_mm;
  out.axis = motion.turn * axis;
  return out;
}

Freedom Freedom::told_by(const Matrix6d& change) const {
  Freedom out = *this;
  out.unknown = change * unknown;
  out.axis = change.topLeftCorner<3, 3>() * axis;
  return out;
}

Freedom Freedom::with(const Freedom& before) const {
  Freedom out = *this;
  if (before.unknown.cols() == 0) return out;
  MatrixXd both(6, unknown.cols() + before.unknown.cols());
  both << unknown, turns_by(radius_mm / before.radius_mm).asDiagonal() * before.unknown;
  both.colwise().normalize();
  out.unknown = orthonormal(both);
  return out;
}

Solution solve(const SlopeInformation& told, const Vector3d& at_mm, double radius_mm,
               const FreedomOptions& options) {
  Solution out;
  out.freedom.at_mm = at_mm;
  out.freedom.radius_mm = radius_mm;
  const Vector6d down = turns_by(1 / radius_mm);
  const MatrixXd known = down.asDiagonal() * told.information * down.asDiagonal();
  // Products of two maps' slopes have no mean where there is nothing but noise; their sum strays by the
  // noise's information over the root of how many pixels are independent, one in kCorrelated_px.
  constexpr double kCorrelated_px = 25, kSure = 6;
  MatrixXd noise = down.asDiagonal() * told.noise * down.asDiagonal();
  // Where the search ended on the wrong wave of a texture both frames' slopes differ as by noise, and agree
  // by chance in less than half.
  noise *= std::max(kSure / std::sqrt(std::max(told.pixels / kCorrelated_px, 1.0)), 1.0);
  noise.diagonal().array() += options.least_slope * options.least_slope * told.weight;
  const dense::Cholesky factor(noise);
  const MatrixXd half = factor.solve_lower(known);
  const MatrixXd whole = factor.solve_lower(MatrixXd(half.transpose()));
  const dense::SymmetricEigen parts = dense::symmetric_eigen((whole + whole.transpose()) / 2);
  // Directions as shifts and turns: the columns of L^-T vectors.
  const MatrixXd inverse_factor = factor.solve_lower(MatrixXd::Identity(6, 6));
  const MatrixXd directions = inverse_factor.transpose() * parts.vectors;
  MatrixXd lost(6, 0);
  Matrix6d inverse = Matrix6d::Zero();
  for (Eigen::Index k = 0; k < 6; ++k) {
    const Vector6d direction = directions.col(k);
    if (parts.values[k] > 1) {
      inverse += direction * direction.transpose() / parts.values[k];
    } else {
      lost.conservativeResize(6, lost.cols() + 1);
      lost.col(lost.cols() - 1) = direction.normalized();
    }
  }
  out.freedom.unknown = orthonormal(lost);
  name(out.freedom);
  out.inverse = down.asDiagonal() * inverse * down.asDiagonal();
  return out;
}

}  // namespace palpate
