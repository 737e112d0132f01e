// Sparse symmetric systems, solved directly; compiled once.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace palpate::sparse {

/// One summand of a matrix; those of the same place add up.
class Entry {
 public:
  Entry(int row, int column, double value) : row_(row), column_(column), value_(value) {}
  int row() const { return row_; }
  int col() const { return column_; }
  double value() const { return value_; }

 private:
  int row_, column_;
  double value_;
};

/// Factor of a matrix whose lower half is read. Throws nothing: a matrix that cannot be factored is not ok(),
/// and nothing else may be asked then.
class Factor {
 public:
  enum class Kind { Llt, Ldlt };  ///< Llt: positive definite only

  Factor(Kind kind, int unknowns, const std::vector<Entry>& entries);
  bool ok() const;
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  size_t values() const;  ///< of the triangular factor

 private:
  struct Any;
  std::shared_ptr<const Any> factor_;
};

}  // namespace palpate::sparse
