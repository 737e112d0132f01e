#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "engine/numeric/dense.h"

namespace palpate::dense {

Tridiagonal::Tridiagonal(const MatrixXd& a)
    : form_(std::make_shared<const Eigen::Tridiagonalization<MatrixXd>>(a)),
      diagonal_(form_->diagonal()),
      side_(form_->subDiagonal()) {
  Eigen::SelfAdjointEigenSolver<MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal_, side_, Eigen::EigenvaluesOnly);
  eigenvalues_ = solver.eigenvalues();
}
MatrixXd Tridiagonal::q_times(const MatrixXd& x) const {
  return form_->matrixQ() * x;
}
MatrixXd Tridiagonal::qt_times(const MatrixXd& x) const {
  return form_->matrixQ().adjoint() * x;
}

SymmetricEigen symmetric_eigen(const MatrixXd& a) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

VectorXd symmetric_eigenvalues(const MatrixXd& a) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(a, Eigen::EigenvaluesOnly).eigenvalues();
}

VectorXd generalized_eigenvalues(const MatrixXd& a, const MatrixXd& b) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(a, b, Eigen::EigenvaluesOnly).eigenvalues();
}

Svd svd(const MatrixXd& a, unsigned options) {
  const Eigen::JacobiSVD<MatrixXd> solver(a, options);
  Svd found;
  if (solver.computeU()) found.u = solver.matrixU();
  if (solver.computeV()) found.v = solver.matrixV();
  found.values = solver.singularValues();
  return found;
}

}  // namespace palpate::dense
