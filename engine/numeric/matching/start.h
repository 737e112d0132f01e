// Where the template may lie on the target at first: turns that the neighbourhoods vote for.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate {

struct Placement {
  Eigen::MatrixXd points;  ///< the template after the similarity, n x axes
  double turn_deg = 0;     ///< 0 to 180 in space, -180 to 180 in the plane
};

/// Rotations to begin with, for rows: points * turn. In the plane 12 about the origin; in space 12 about the
/// last axis and the four that bring principal axes together. No reflections.
std::vector<Eigen::MatrixXd> starting_turns(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to);
/// Its angle, degrees: 0 to 180 in space, -180 to 180 in the plane.
double angle_of(const Eigen::MatrixXd& turn);

/// In the plane 12 turns; in space 12 about the last axis and the four that bring principal axes together. No
/// reflections.
class Votes {
 public:
  Votes(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to);

  size_t size() const { return votes_.size(); }
  /// Of the kth best turn: 0 where each neighbourhood has its like, to 2.
  double unlikeness(size_t k) const { return votes_[k].unlikeness; }
  double best() const { return unlikeness(0); }
  double unturned() const { return unturned_; }
  /// The similarity that fits the partners which the neighbourhoods name after the kth best turn, outliers
  /// weighed down.
  Placement place(size_t k) const;

 private:
  struct Vote {
    double unlikeness;
    Eigen::MatrixXf likeness;  // centres x targets
  };
  Eigen::MatrixXd from_, centres_, targets_;
  std::vector<Vote> votes_;
  double unturned_ = 0;
};

}  // namespace palpate
