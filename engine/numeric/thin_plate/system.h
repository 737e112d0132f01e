// The linear algebra under thin-plate splines: the saddle system reduced to where the polynomial is not.
#pragma once

#include <optional>
#include <vector>

#include "engine/numeric/dense.h"
#include "engine/numeric/thin_plate/kernel.h"

namespace palpate {

/// With weights W the unknowns are scaled by their roots: (W^1/2 K W^1/2 + lambda) w + W^1/2 P a = W^1/2 z. N
/// spans what is orthogonal to W^1/2 P, and B = N^T W^1/2 K W^1/2 N is positive definite.
class PlateSystem {
 public:
  struct Solution {
    Eigen::MatrixXd weight, polynomial;  ///< points x fields, (1 + axes) x fields
    Eigen::VectorXd chi_square;          ///< per field: sum of weighted squares
    double lambda = 0;
    bool raised = false;
    double freedom = 0;  ///< NaN: not asked for
    double condition = 1;
  };
  struct Choice {
    double lambda = 0, gcv = 0;
  };

  /// `at`: axes x points, already about their centre and scaled.
  PlateSystem(PlateKernel kernel, uint32_t axes, const std::vector<double>& at,
              const std::vector<double>& weight);

  Solution solve(const Eigen::MatrixXd& values, double lambda, bool spread);
  /// The lambda of the least robust GCV score, and its plain score. `within`: what averaging left out of the
  /// values, sum of weighted squares; `averaged`: by how many more values there were.
  Choice choose(const Eigen::MatrixXd& values, double within, size_t averaged);
  /// The first block of S^-1 (kernel, polynomial), S the saddle matrix at this lambda.
  Eigen::VectorXd row(const Eigen::VectorXd& kernel, const Eigen::VectorXd& polynomial, double lambda);

 private:
  struct Tridiagonal {
    explicit Tridiagonal(const Eigen::MatrixXd& matrix);
    Eigen::MatrixXd solve(const Eigen::MatrixXd& right, double lambda) const;  ///< in its own basis
    dense::Tridiagonal form;
    Eigen::VectorXd eigenvalues;
  };
  void factor(double lambda);
  Eigen::MatrixXd reduced(const Eigen::MatrixXd& right, double lambda);  ///< (B + lambda)^-1 right

  Eigen::Index points_, terms_;
  Eigen::VectorXd root_;    // of the weights
  dense::Qr polynomial_;    // of W^1/2 P
  Eigen::MatrixXd kernel_;  // W^1/2 K W^1/2
  Eigen::MatrixXd free_;    // B
  std::optional<Tridiagonal> tridiagonal_;
  std::optional<dense::Cholesky> cholesky_;
  std::optional<double> asked_;  // what cholesky_ is of
  double factored_ = 0;          // and what it could be made of
  double inverse_trace_ = -1;    // of that; below 0: not known
};

}  // namespace palpate
