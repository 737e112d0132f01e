// Small neighbourhoods of the template found again in the target, whatever lies around them.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace palpate {

struct Seed {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> pairs;  ///< template point, target point
  double miss = 0;  ///< mean square of what the seed's affine map leaves, per axis
};

/// Neighbourhoods that an affine map brings onto points of the target to a fraction of the points' spacing,
/// the fullest and closest first, at most so many and none twice. In the plane; none in space.
std::vector<Seed> find_seeds(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to, double spacing,
                             double most_turn_deg, size_t most);

}  // namespace palpate
