// Where the template may lie on the target at first: turns that the neighbourhoods vote for.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate {

struct Placement {
  Eigen::MatrixXd points;  ///< the template after the similarity, n x axes
  double turn_deg = 0;     ///< 0 to 180 in space, -180 to 180 in the plane
};

/// Its angle, degrees: 0 to 180 in space, -180 to 180 in the plane. Of a reflection that of the turn which
/// follows the mirror x -> -x.
double angle_of(const Eigen::MatrixXd& turn);

/// Turns to begin with, the likeliest first: in the plane 12; in space 12 about the last axis, those of a
/// cube, and the four that bring principal axes together. With `reflections` the same after the mirror x ->
/// -x.
class Votes {
 public:
  Votes(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to, bool reflections);

  size_t size() const { return votes_.size(); }
  /// Unlikeness of the kth best turn: 0 where each neighbourhood has its like, to 2.
  double unlikeness(size_t k) const { return votes_[k].unlikeness; }
  /// For rows: points * turn.
  const Eigen::MatrixXd& turn(size_t k) const { return votes_[k].turn; }
  /// Likeness of each template point's neighbourhood, turned so, and each target point's; none where sets
  /// were thinned.
  const Eigen::MatrixXf* likeness(size_t k) const { return thinned_ ? nullptr : &votes_[k].likeness; }
  /// The similarity that fits the partners which the neighbourhoods name after the kth best turn, outliers
  /// weighed down.
  Placement place(size_t k) const;

 private:
  struct Vote {
    Eigen::MatrixXd turn;
    double unlikeness;
    Eigen::MatrixXf likeness;  // centres x targets
  };
  Eigen::MatrixXd from_, centres_, targets_;
  std::vector<Vote> votes_;
  bool thinned_ = false;
};

}  // namespace palpate
