#include <Eigen/Cholesky>

#include "engine/numeric/dense.h"

namespace palpate::dense {

Cholesky::Cholesky(const MatrixXd& a) : factor_(std::make_shared<const Eigen::LLT<MatrixXd>>(a)) {}
bool Cholesky::ok() const {
  return factor_->info() == Eigen::Success;
}
double Cholesky::rcond() const {
  return factor_->rcond();
}
MatrixXd Cholesky::lower() const {
  return factor_->matrixL();
}
MatrixXd Cholesky::solve(const MatrixXd& right) const {
  return factor_->solve(right);
}
VectorXd Cholesky::solve(const VectorXd& right) const {
  return factor_->solve(right);
}
MatrixXd Cholesky::solve_lower(const MatrixXd& right) const {
  return factor_->matrixL().solve(right);
}

Ldlt::Ldlt(const MatrixXd& a) : factor_(std::make_shared<const Eigen::LDLT<MatrixXd>>(a)) {}
bool Ldlt::positive() const {
  return factor_->info() == Eigen::Success && factor_->isPositive();
}
double Ldlt::rcond() const {
  return factor_->rcond();
}
MatrixXd Ldlt::solve(const MatrixXd& right) const {
  return factor_->solve(right);
}
VectorXd Ldlt::solve(const VectorXd& right) const {
  return factor_->solve(right);
}

template <int N>
Eigen::Matrix<double, N, 1> solve_ldlt(const Eigen::Matrix<double, N, N>& a,
                                       const Eigen::Matrix<double, N, 1>& right) {
  return a.ldlt().solve(right);
}
template Eigen::Matrix<double, 2, 1> solve_ldlt<2>(const Eigen::Matrix2d&, const Eigen::Vector2d&);
template Eigen::Matrix<double, 3, 1> solve_ldlt<3>(const Eigen::Matrix3d&, const Eigen::Vector3d&);
template Eigen::Matrix<double, 4, 1> solve_ldlt<4>(const Eigen::Matrix4d&, const Eigen::Vector4d&);
template Eigen::Matrix<double, 5, 1> solve_ldlt<5>(const Eigen::Matrix<double, 5, 5>&,
                                                   const Eigen::Matrix<double, 5, 1>&);
template Eigen::Matrix<double, 9, 1> solve_ldlt<9>(const Eigen::Matrix<double, 9, 9>&,
                                                   const Eigen::Matrix<double, 9, 1>&);

}  // namespace palpate::dense
