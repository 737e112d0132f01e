// Maps without bending, for sets of few points: every similarity and every affine map that some points of the
// template and as many of the target ask for.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace palpate {

struct UnbentOptions {
  double most_turn_deg = 180;
  bool reflections = false;
  double energy_without = 0;  ///< -log likelihood of all target points without any template
  double log_volume = 0;      ///< of the box that strangers are spread over
  double resolution = 0;      ///< step of the coordinates' digits: points lie no closer than it says
};

struct UnbentMap {
  Eigen::MatrixXd map;  ///< (1 + axes) x axes: place = (1, point) * map
  double sd = 0;        ///< of the pairs about it, per axis
  Eigen::Index pairs = 0;
  /// Nats by which it explains the target better than no template does, the map's freedom and the choice of
  /// partners paid for (Student's marginal likelihood: the noise is not known beforehand).
  double evidence = 0;
  double turn_deg = 0;
  /// Posterior of this map against all others that bring the template somewhere else, 0 to 1.
  double posterior = 0;
};

/// The best of all such maps. One more pair than an affine map fits by itself is needed (axes + 2), and 30 %
/// of the smaller set. None: no map has as many, or the sets are too large to try every one (some 10^6 of
/// them).
std::optional<UnbentMap> find_unbent(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to,
                                     const UnbentOptions& options);

}  // namespace palpate
