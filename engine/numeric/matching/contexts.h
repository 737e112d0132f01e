// Shape contexts: how a point sees its neighbours, by direction and logarithm of distance.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace palpate {

/// Histograms turned about the last axis by a whole number of these are the same ones with their cells moved.
inline constexpr int kContextDirections = 12;

/// The cell that each other point falls into as seen from each centre, kept so that histograms for other
/// weights of the points are cheap. Cells overlap (linear weights), so that noise does not flip them.
class ContextCells {
 public:
  /// Points x axes (2 or 3); `scale`: the length that counts as 1, about the mean distance of points.
  ContextCells(const Eigen::MatrixXf& centres, const Eigen::MatrixXf& others, float scale);

  /// cells x centres: roots of the shares of weight, so that the product of two columns is their likeness,
  /// 0 to 1. `weight`: of each of the others.
  Eigen::MatrixXf histograms(const Eigen::VectorXf& weight) const;

 private:
  struct Cell {
    int16_t direction, ring;  // ring < 0: too far, or the centre itself
    float next_direction, next_ring, height;
  };
  Eigen::Index centres_, others_;
  int layers_;  // by height: 1 in the plane
  std::vector<Cell> cells_;
};

/// Histograms as seen by points that are turned by steps / kContextDirections of a whole turn.
Eigen::MatrixXf turned(const Eigen::MatrixXf& histograms, int steps);

/// Mean distance of pairs of points x axes, of at most some 10^4 of them.
float mean_distance(const Eigen::MatrixXf& points);

}  // namespace palpate
