// Pad field: what a pad itself errs by, which goes over the object with it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "engine/motion/rigid_motion.h"

namespace palpate {

/// What key frames show other than the map of all others, part by part of the pad.
class PadField {
 public:
  static constexpr size_t kCells = 12;  ///< along and across the pad
  struct Mean {
    double sum_mm = 0, weight = 0;
  };

  /// A frame's differences, row by row of the pad.
  void add(const std::vector<Mean>& means);
  /// Standard error by what the differences have in common, beyond what they stray by.
  double error_mm() const;
  /// Covariance of the pad's own curvatures (1/mm; along x, along y, twist), of a pad of that size. A map
  /// bends by as much over its whole length, and no two frames differ: the field's waves of third and fourth
  /// order, which frames do show, tell how large those of second order may be.
  Eigen::Matrix3d curvature_covariance(double width_mm, double height_mm) const;

 private:
  struct Cell {
    double sum_mm = 0, squares_mm2 = 0, frames = 0;
    bool known() const;
    double mean_mm() const { return sum_mm / frames; }
  };
  std::vector<Cell> cells_ = std::vector<Cell>(kCells * kCells);
  std::vector<std::vector<float>> frames_;  ///< of each frame, mm; NaN where it tells nothing
};

/// How far a map may be bent by its pad's own curvature, once it is aligned as a whole.
class MapBend {
 public:
  MapBend() = default;
  /// `curvature`: covariance in the map's axes. `places`: of the map, mm.
  MapBend(const Eigen::Matrix3d& curvature, const std::vector<Eigen::Vector2d>& places);

  double variance_mm2(const Eigen::Vector2d& place) const;
  /// What it adds to the covariance of a pad's missing motion, seen at `middle_mm` of the pad.
  Matrix6d of_motion(const RigidMotion& motion, const Eigen::Vector3d& middle_mm) const;

 private:
  Eigen::Matrix3d curvature_ = Eigen::Matrix3d::Zero();
  Eigen::Vector2d middle_mm_ = Eigen::Vector2d::Zero();
  Eigen::Matrix3d plane_ = Eigen::Matrix3d::Zero();  ///< which alignment takes off each: level, slopes
};

/// Curvatures (along x, along y, twist) of a pad as the map has them.
Eigen::Matrix3d curvatures_in_map(const RigidMotion& motion);

}  // namespace palpate
