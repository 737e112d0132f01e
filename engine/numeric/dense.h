// Dense algebra, compiled once: products of large matrices and decompositions.
//
// Callers see Eigen's matrices (<Eigen/Core>); its algorithms are instantiated in numeric/dense/*.cpp only,
// which spares each caller their seconds of compilation. Every function is the expression of Eigen's that its
// comment shows, to the last bit. Matrices may be empty; sizes must fit (checked by Eigen in debug builds).
#pragma once

#include <Eigen/Core>
#include <memory>

namespace Eigen {
template <typename Matrix>
class Tridiagonalization;
}

namespace palpate::dense {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Eigen::VectorXf;

// Products
MatrixXd product(const MatrixXd& a, const MatrixXd& b);                           ///< a b
MatrixXd product(double factor, const MatrixXd& a, const MatrixXd& b);            ///< (factor a) b
MatrixXd minus_product(const MatrixXd& c, const MatrixXd& a, const MatrixXd& b);  ///< c - a b
VectorXd minus_product(const VectorXd& c, const MatrixXd& a, const VectorXd& b);  ///< c - a b
MatrixXd product_tn(const MatrixXd& a, const MatrixXd& b);                        ///< a^T b
VectorXd product_tn(const MatrixXd& a, const VectorXd& b);                        ///< a^T b
MatrixXd product_nt(const MatrixXd& a, const MatrixXd& b);                        ///< a b^T
MatrixXd product_nt(double factor, const MatrixXd& a, const MatrixXd& b);         ///< (factor a) b^T
MatrixXf product(const MatrixXf& a, const MatrixXf& b);                           ///< a b
MatrixXf product_tn(const MatrixXf& a, const MatrixXf& b);                        ///< a^T b
MatrixXf product_nt(const MatrixXf& a, const MatrixXf& b);                        ///< a b^T
MatrixXd spectral(const MatrixXd& vectors, const VectorXd& values);      ///< vectors diag(values) vectors^T
void product_into(MatrixXf& out, const MatrixXf& a, const MatrixXf& b);  ///< out = a b, neither being out
/// The lower half of sum += a a^T; the upper half is not touched.
void add_square(MatrixXd& sum, const MatrixXd& a);
void add_square(MatrixXf& sum, const MatrixXf& a);
void add_square_tn(MatrixXd& sum, const MatrixXd& a);  ///< a^T a
/// The whole of a symmetric matrix whose lower half is given.
MatrixXd from_lower(const MatrixXd& a);
MatrixXf from_lower(const MatrixXf& a);

// Triangular matrices: only the lower half of `l` is read
MatrixXd solve_lower(const MatrixXd& l, const MatrixXd& right);  ///< l^-1 right
VectorXd lower_times(const MatrixXd& l, const VectorXd& v);      ///< l v

// Symmetric systems
/// a = L L^T of a positive definite matrix.
class Cholesky {
 public:
  explicit Cholesky(const MatrixXd& a);
  /// False where `a` is not positive definite; nothing else may be asked then.
  bool ok() const;
  double rcond() const;
  MatrixXd lower() const;
  MatrixXd solve(const MatrixXd& right) const;
  VectorXd solve(const VectorXd& right) const;
  MatrixXd solve_lower(const MatrixXd& right) const;  ///< L^-1 right

 private:
  std::shared_ptr<const Eigen::LLT<MatrixXd>> factor_;
};

/// a = P^T L D L^T P of a semi-definite matrix.
class Ldlt {
 public:
  explicit Ldlt(const MatrixXd& a);
  bool positive() const;  ///< and no failure on the way
  double rcond() const;
  MatrixXd solve(const MatrixXd& right) const;
  VectorXd solve(const VectorXd& right) const;

 private:
  std::shared_ptr<const Eigen::LDLT<MatrixXd>> factor_;
};

/// Small ones of fixed size, by LDL^T: N = 2, 3, 4, 5 and 9.
template <int N>
Eigen::Matrix<double, N, 1> solve_ldlt(const Eigen::Matrix<double, N, N>& a,
                                       const Eigen::Matrix<double, N, 1>& right);

/// a = Q T Q^T of a symmetric matrix, T tridiagonal.
class Tridiagonal {
 public:
  explicit Tridiagonal(const MatrixXd& a);
  const VectorXd& diagonal() const { return diagonal_; }
  const VectorXd& side() const { return side_; }
  const VectorXd& eigenvalues() const { return eigenvalues_; }  ///< rising
  MatrixXd q_times(const MatrixXd& x) const;
  MatrixXd qt_times(const MatrixXd& x) const;

 private:
  std::shared_ptr<const Eigen::Tridiagonalization<MatrixXd>> form_;
  VectorXd diagonal_, side_, eigenvalues_;
};

/// Eigenvalues, rising, and their vectors as columns; the lower half of `a` is read.
struct SymmetricEigen {
  VectorXd values;
  MatrixXd vectors;
};
SymmetricEigen symmetric_eigen(const MatrixXd& a);
VectorXd symmetric_eigenvalues(const MatrixXd& a);
/// Eigenvalues of a x = lambda b x, b positive definite; rising.
VectorXd generalized_eigenvalues(const MatrixXd& a, const MatrixXd& b);

// General systems
MatrixXd solve_lu(const MatrixXd& a, const MatrixXd& right);
VectorXd solve_lu(const MatrixXd& a, const VectorXd& right);
MatrixXd inverse(const MatrixXd& a);  ///< by LU
double determinant(const MatrixXd& a);

/// a = Q R, Q rows x rows.
class Qr {
 public:
  explicit Qr(const MatrixXd& a);
  MatrixXd q_times(const MatrixXd& x) const;
  VectorXd q_times(const VectorXd& x) const;
  MatrixXd qt_times(const MatrixXd& x) const;
  VectorXd qt_times(const VectorXd& x) const;
  MatrixXd times_q(const MatrixXd& x) const;
  MatrixXd solve_r(const MatrixXd& right) const;   ///< R^-1 right
  VectorXd solve_rt(const VectorXd& right) const;  ///< R^-T right

 private:
  std::shared_ptr<const Eigen::HouseholderQR<MatrixXd>> factor_;
};

/// Least squares by QR with pivots; `threshold` < 0: Eigen's own, of what counts as nothing.
VectorXd least_squares(const MatrixXd& a, const VectorXd& right, double threshold = -1);
/// The whole orthogonal factor (rows x rows) of that decomposition; its first `rank` columns span a's.
struct ColumnSpace {
  MatrixXd q;
  Index rank = 0;
};
ColumnSpace column_space(const MatrixXd& a, double threshold);
/// Orthonormal columns that span those of `a`, which are independent.
MatrixXd thin_q(const MatrixXd& a);
/// The shortest least squares' solution, by a complete orthogonal decomposition.
VectorXd shortest_solution(const MatrixXd& a, const VectorXd& right);
MatrixXd pseudo_inverse(const MatrixXd& a);

/// a = U diag(values) V^T, values falling. `options`: Eigen::ComputeThinU and its like; what is not asked for
/// stays empty.
struct Svd {
  MatrixXd u, v;
  VectorXd values;
};
Svd svd(const MatrixXd& a, unsigned options);

}  // namespace palpate::dense
