// Rigid motions of space, and what small errors of them are.
#pragma once

#include <Eigen/Core>

namespace palpate {

using Vector6d = Eigen::Matrix<double, 6, 1>;  ///< three shifts, then three turns in radians
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// x becomes turn x + shift_mm.
struct RigidMotion {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< a rotation
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return turn * x + shift_mm; }
  /// First `other`, then this one.
  RigidMotion operator*(const RigidMotion& other) const {
    return {turn * other.turn, turn * other.shift_mm + shift_mm};
  }
  RigidMotion inverse() const { return {turn.transpose(), -(turn.transpose() * shift_mm)}; }
};

/// u with cross(w) u = w x u.
Eigen::Matrix3d cross(const Eigen::Vector3d& w);
/// The rotation by |w| radians about w.
Eigen::Matrix3d turn_of(const Eigen::Vector3d& w);
/// Its inverse; of half a turn and more the shorter way round.
Eigen::Vector3d turn_vector(const Eigen::Matrix3d& turn);
/// What small turns after a rotation add to its rotation vector `turn`, as a matrix.
Eigen::Matrix3d turn_vector_slope(const Eigen::Vector3d& turn);

/// Turns about `at` and shifts by the small motion `twist` (radians), in that order.
RigidMotion motion_about(const Eigen::Vector3d& at, const Vector6d& twist);
/// The small motion which leads from `from` to `to` (to = motion_about(at, twist) from).
Vector6d twist_between(const RigidMotion& from, const RigidMotion& to, const Eigen::Vector3d& at);

/// The same small motions seen at another place: M with twist_to = M twist_from.
Matrix6d seen_at(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
/// What an error before `motion`, seen at x, is after it, seen at motion x.
Matrix6d carried_by(const RigidMotion& motion);

}  // namespace palpate
