#include <Eigen/LU>
#include <Eigen/QR>

#include "engine/numeric/dense.h"

namespace palpate::dense {

MatrixXd solve_lu(const MatrixXd& a, const MatrixXd& right) {
  return a.partialPivLu().solve(right);
}
VectorXd solve_lu(const MatrixXd& a, const VectorXd& right) {
  return a.partialPivLu().solve(right);
}
MatrixXd inverse(const MatrixXd& a) {
  return a.inverse();
}
double determinant(const MatrixXd& a) {
  return a.determinant();
}

Qr::Qr(const MatrixXd& a) : factor_(std::make_shared<const Eigen::HouseholderQR<MatrixXd>>(a)) {}
MatrixXd Qr::q_times(const MatrixXd& x) const {
  return factor_->householderQ() * x;
}
VectorXd Qr::q_times(const VectorXd& x) const {
  return factor_->householderQ() * x;
}
MatrixXd Qr::qt_times(const MatrixXd& x) const {
  return factor_->householderQ().adjoint() * x;
}
VectorXd Qr::qt_times(const VectorXd& x) const {
  return factor_->householderQ().adjoint() * x;
}
MatrixXd Qr::times_q(const MatrixXd& x) const {
  return x * factor_->householderQ();
}
MatrixXd Qr::solve_r(const MatrixXd& right) const {
  return factor_->matrixQR().topRows(right.rows()).triangularView<Eigen::Upper>().solve(right);
}
VectorXd Qr::solve_rt(const VectorXd& right) const {
  return factor_->matrixQR().topRows(right.rows()).triangularView<Eigen::Upper>().adjoint().solve(right);
}

VectorXd least_squares(const MatrixXd& a, const VectorXd& right, double threshold) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
  if (threshold >= 0) qr.setThreshold(threshold);
  return qr.solve(right);
}

ColumnSpace column_space(const MatrixXd& a, double threshold) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
  qr.setThreshold(threshold);
  MatrixXd q = MatrixXd::Identity(a.rows(), a.rows());
  q.applyOnTheLeft(qr.householderQ());
  return {std::move(q), qr.rank()};
}

MatrixXd thin_q(const MatrixXd& a) {
  const Eigen::HouseholderQR<MatrixXd> qr(a);
  return qr.householderQ() * MatrixXd::Identity(a.rows(), a.cols());
}

VectorXd shortest_solution(const MatrixXd& a, const VectorXd& right) {
  return a.completeOrthogonalDecomposition().solve(right);
}

MatrixXd pseudo_inverse(const MatrixXd& a) {
  return a.completeOrthogonalDecomposition().pseudoInverse();
}

}  // namespace palpate::dense
