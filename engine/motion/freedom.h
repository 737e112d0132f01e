// Freedom: the directions of a rigid motion which a surface does not determine.
#pragma once

#include <Eigen/Core>
#include <array>

#include "engine/motion/rigid_motion.h"
#include "palpate/object_pose.h"

namespace palpate {

/// The directions are twists seen at at_mm: three shifts, mm, and three turns, radians times radius_mm.
struct Freedom {
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  double radius_mm = 1;  ///< of the contact; it makes turns and shifts comparable
  Eigen::Matrix<double, 6, Eigen::Dynamic> unknown{6, 0};  ///< orthonormal columns
  Slippage kind = Slippage::None;
  /// A point on the axis, or the ball's centre; only for Ball, Cylinder, Revolution and Screw.
  Eigen::Vector3d pivot_mm = Eigen::Vector3d::Zero();
  /// Direction of the axis or line; of Plane its normal. Not for Ball and Other.
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();

  /// Part of a shift (0 to 2) or turn (3 to 5) that is unknown, 0 to 1.
  double unknown_share(int component) const;
  /// Whether it is known: a share of at most kShare. What is left of it counts as an error (unknown_sd).
  bool determined(int component) const { return unknown_share(component) <= kShare; }
  static constexpr double kShare = 0.1;
  /// Standard error of a component by what is unknown, mm or radians: of turns about axes along the pad
  /// `roll_rad`, what the contact's way allows a body that rolls; of a turn about the normal up to a radian,
  /// all alike; of shifts the radius.
  double unknown_sd(int component, double roll_rad) const;

  /// Whether pivot_mm is one.
  bool has_pivot() const {
    return kind == Slippage::Ball || kind == Slippage::Cylinder || kind == Slippage::Revolution ||
           kind == Slippage::Screw;
  }
  /// Of the motions that differ from this one by what is unknown, the one that turns least: a ball's is the
  /// shift of its centre.
  RigidMotion least_turn(const RigidMotion& motion) const;

  /// The same seen at another place.
  Freedom at(const Eigen::Vector3d& place) const;
  /// The same after the surface has moved.
  Freedom after(const RigidMotion& motion) const;
  /// By other components: `change` makes them of twists seen here.
  Freedom told_by(const Matrix6d& change) const;
  /// What is unknown of a motion after another one: either's. `before` is seen at the same place.
  Freedom with(const Freedom& before) const;
};

/// What a surface tells of small motions, both matrices for twists seen at at_mm with turns in radians:
/// `information` without what noise adds to it, and what noise of the slopes alone makes of it, of `pixels`.
/// `weight`: sum of the pixels' weights.
struct SlopeInformation {
  Matrix6d information, noise;
  double weight = 0;
  double pixels = 0;
};

struct FreedomOptions {
  /// Slopes below this, as the RMS over the contact, are what the pad's own errors may make: they determine
  /// nothing, however little noise there is.
  double least_slope = 0.01;
};

struct Solution {
  Freedom freedom;
  Matrix6d inverse;  ///< of the information within what is known, 0 along what is not; turns in radians
};
Solution solve(const SlopeInformation& told, const Eigen::Vector3d& at_mm, double radius_mm,
               const FreedomOptions& options = {});

}  // namespace palpate
