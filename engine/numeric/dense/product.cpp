#include "engine/numeric/dense.h"

namespace palpate::dense {

MatrixXd product(const MatrixXd& a, const MatrixXd& b) {
  return a * b;
}
MatrixXd product(double factor, const MatrixXd& a, const MatrixXd& b) {
  return factor * a * b;
}
MatrixXd minus_product(const MatrixXd& c, const MatrixXd& a, const MatrixXd& b) {
  return c - a * b;
}
VectorXd minus_product(const VectorXd& c, const MatrixXd& a, const VectorXd& b) {
  return c - a * b;
}
MatrixXd product_tn(const MatrixXd& a, const MatrixXd& b) {
  return a.transpose() * b;
}
VectorXd product_tn(const MatrixXd& a, const VectorXd& b) {
  return a.transpose() * b;
}
MatrixXd product_nt(const MatrixXd& a, const MatrixXd& b) {
  return a * b.transpose();
}
MatrixXd product_nt(double factor, const MatrixXd& a, const MatrixXd& b) {
  return factor * a * b.transpose();
}
MatrixXf product(const MatrixXf& a, const MatrixXf& b) {
  return a * b;
}
MatrixXf product_tn(const MatrixXf& a, const MatrixXf& b) {
  return a.transpose() * b;
}
MatrixXf product_nt(const MatrixXf& a, const MatrixXf& b) {
  return a * b.transpose();
}
MatrixXd spectral(const MatrixXd& vectors, const VectorXd& values) {
  return vectors * values.asDiagonal() * vectors.transpose();
}
void product_into(MatrixXf& out, const MatrixXf& a, const MatrixXf& b) {
  out.noalias() = a * b;
}

void add_square(MatrixXd& sum, const MatrixXd& a) {
  sum.selfadjointView<Eigen::Lower>().rankUpdate(a);
}
void add_square(MatrixXf& sum, const MatrixXf& a) {
  sum.selfadjointView<Eigen::Lower>().rankUpdate(a);
}
void add_square_tn(MatrixXd& sum, const MatrixXd& a) {
  sum.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
}
MatrixXd from_lower(const MatrixXd& a) {
  return a.selfadjointView<Eigen::Lower>();
}
MatrixXf from_lower(const MatrixXf& a) {
  return a.selfadjointView<Eigen::Lower>();
}

MatrixXd solve_lower(const MatrixXd& l, const MatrixXd& right) {
  return l.triangularView<Eigen::Lower>().solve(right);
}
VectorXd lower_times(const MatrixXd& l, const VectorXd& v) {
  return l.triangularView<Eigen::Lower>() * v;
}

}  // namespace palpate::dense
