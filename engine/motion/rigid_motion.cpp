#include "engine/motion/rigid_motion.h"

#include <algorithm>
#include <cmath>

namespace palpate {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d cross(const Vector3d& w) {
  Matrix3d m;
  m << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  return m;
}

Matrix3d turn_of(const Vector3d& w) {
  const double angle = w.norm();
  const Matrix3d m = cross(w);
  // Rodrigues' formula, and its series where the angle is next to nothing.
  const double a = angle < 1e-6 ? 1 - angle * angle / 6 : std::sin(angle) / angle;
  const double b = angle < 1e-6 ? 0.5 : (1 - std::cos(angle)) / (angle * angle);
  return Matrix3d::Identity() + a * m + b * m * m;
}

Vector3d turn_vector(const Matrix3d& turn) {
  const Vector3d twice_sine(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
  const double sine = twice_sine.norm() / 2, cosine = (turn.trace() - 1) / 2;
  const double angle = std::atan2(sine, cosine);
  if (sine > 1e-6) return twice_sine * (angle / (2 * sine));
  if (cosine > 0) return twice_sine / 2;
  // Half a turn: the axis is the longest column of turn + 1.
  const Matrix3d sum = turn + Matrix3d::Identity();
  Eigen::Index longest = 0;
  sum.colwise().squaredNorm().maxCoeff(&longest);
  return sum.col(longest).normalized() * angle;
}

Matrix3d turn_vector_slope(const Vector3d& turn) {
  const Matrix3d m = cross(turn);
  const double angle = turn.norm(), half = angle / 2;
  const double square = angle < 1e-3 ? 1.0 / 12 : (1 - half / std::tan(half)) / (angle * angle);
  return Matrix3d::Identity() - m / 2 + square * m * m;
}

RigidMotion motion_about(const Vector3d& at, const Vector6d& twist) {
  const Matrix3d turn = turn_of(twist.tail<3>());
  return {turn, at - turn * at + twist.head<3>()};
}

Vector6d twist_between(const RigidMotion& from, const RigidMotion& to, const Vector3d& at) {
  const RigidMotion step = to * from.inverse();
  Vector6d twist;
  twist << step * at - at, turn_vector(step.turn);
  return twist;
}

Matrix6d seen_at(const Vector3d& from, const Vector3d& to) {
  Matrix6d m = Matrix6d::Identity();
  m.topRightCorner<3, 3>() = -cross(to - from);  // v(to) = v(from) + w x (to - from)
  return m;
}

Matrix6d carried_by(const RigidMotion& motion) {
  Matrix6d m = Matrix6d::Zero();
  m.topLeftCorner<3, 3>() = motion.turn;
  m.bottomRightCorner<3, 3>() = motion.turn;
  return m;
}

}  // namespace palpate
