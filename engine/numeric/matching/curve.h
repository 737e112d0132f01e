// The order of a template's points along the one curve that they lie on.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace palpate {

struct Curve {
  std::vector<Eigen::Index> order;  ///< of most points, from one end to the other
  bool closed = false;              ///< the ends are next to each other
};

/// The longest path of the shortest tree that links all points. None: fewer than 12 points, or a path that
/// leaves out more than a quarter of them, as it does of points that fill an area or lie on several curves.
std::optional<Curve> curve_through(const Eigen::MatrixXd& points);

}  // namespace palpate
