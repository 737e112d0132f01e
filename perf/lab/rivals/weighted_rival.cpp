#include "perf/lab/rivals/weighted_rival.h"

#include <Eigen/SparseCholesky>

namespace palpate::perf {

std::vector<double> solve_with_eigen(const WeightedFaces& f) {
  const auto n = static_cast<Eigen::Index>(f.across.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(f.across.size() * 9);
  const auto couple = [&](Eigen::Index i, Eigen::Index j, double w) {
    if (!(w > 0)) return;
    entries.emplace_back(i, i, w);
    entries.emplace_back(j, j, w);
    entries.emplace_back(j, i, -w);
  };
  // A little on the diagonal holds parts that nothing else does.
  constexpr double kHold = 1e-9;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<size_t>(i);
    entries.emplace_back(i, i, kHold);
    if (at % f.width + 1 < f.width) couple(i, i + 1, f.across_weight[at]);
    if (at / f.width + 1 < f.height) couple(i, i + f.width, f.down_weight[at]);
  }
  Eigen::SparseMatrix<double> a(n, n);
  a.setFromTriplets(entries.begin(), entries.end());
  const std::vector<double> right = right_side(f);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(a);
  const Eigen::VectorXd z = factors.solve(Eigen::Map<const Eigen::VectorXd>(right.data(), n));
  return {z.data(), z.data() + n};
}

}  // namespace palpate::perf
