#include "engine/numeric/sparse.h"

#include <Eigen/SparseCholesky>
#include <variant>

namespace palpate::sparse {

using Matrix = Eigen::SparseMatrix<double>;

struct Factor::Any {
  std::variant<Eigen::SimplicialLLT<Matrix>, Eigen::SimplicialLDLT<Matrix>> of;
};

Factor::Factor(Kind kind, int unknowns, const std::vector<Entry>& entries) {
  Matrix matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  auto factor = std::make_shared<Any>();
  if (kind == Kind::Ldlt) factor->of.emplace<1>();
  std::visit([&](auto& f) { f.compute(matrix); }, factor->of);
  factor_ = std::move(factor);
}

bool Factor::ok() const {
  return std::visit([](const auto& f) { return f.info() == Eigen::Success; }, factor_->of);
}

Eigen::VectorXd Factor::solve(const Eigen::VectorXd& right) const {
  return std::visit([&](const auto& f) -> Eigen::VectorXd { return f.solve(right); }, factor_->of);
}

size_t Factor::values() const {
  return std::visit(
      [](const auto& f) { return static_cast<size_t>(f.matrixL().nestedExpression().nonZeros()); },
      factor_->of);
}

}  // namespace palpate::sparse
