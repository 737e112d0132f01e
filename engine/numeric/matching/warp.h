// The smooth warps that a template may take: an affine map, free, and the strongest modes of a Gaussian
// process, each of unit variance.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate {

/// Made from the template, of RMS distance 1 from its centre. A warp is basis(points) * coefficients, with
/// affine() rows of coefficients that cost nothing; the others cost half their squares over the amplitude.
class WarpModes {
 public:
  explicit WarpModes(const Eigen::MatrixXd& points);

  Eigen::MatrixXd basis(const Eigen::MatrixXd& points) const;  ///< points x (affine() + modes)
  Eigen::Index affine() const { return landmarks_.cols() + 1; }

 private:
  Eigen::MatrixXd landmarks_;  // a spread subset of the points
  Eigen::MatrixXd modes_;      // landmarks x modes
};

/// (1, point), a row each: what an affine map is multiplied with.
Eigen::MatrixXd with_ones(const Eigen::MatrixXd& points);

/// Indices of `count` points, each the farthest from those before it; the first is the one farthest from the
/// centre. In order; ties to the lower index.
std::vector<Eigen::Index> spread_subset(const Eigen::MatrixXd& points, Eigen::Index count);

}  // namespace palpate
