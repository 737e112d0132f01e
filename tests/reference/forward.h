// The forward model's equations in plain loops and double precision: elements by quadrature from their
// definition, the matrix assembled, a direct solve.
#pragma once

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "engine/fem/linear/grid.h"

namespace palpate::reference {

/// Energy's second derivatives of a brick of unit modulus, entry [3 * corner + component] each way.
inline std::array<std::array<double, 24>, 24> brick(const std::array<double, 3>& size, double poisson) {
  const double mu = 0.5 / (1 + poisson), kappa = 1 / (3 * (1 - 2 * poisson));
  const double volume = size[0] * size[1] * size[2];
  std::array<std::array<double, 24>, 24> k{};
  std::array<double, 24> divergence{};
  // Three points a side, one more than needed.
  const double place[3] = {0.5 - std::sqrt(0.15), 0.5, 0.5 + std::sqrt(0.15)};
  const double weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (int p = 0; p < 27; ++p) {
    const std::array<double, 3> t = {place[p % 3], place[p / 3 % 3], place[p / 9]};
    const double w = weight[p % 3] * weight[p / 3 % 3] * weight[p / 9] * volume;
    // Gradient of each unknown's displacement: g[row][i][j] = d u_i / d x_j.
    std::array<std::array<std::array<double, 3>, 3>, 24> g{};
    for (int corner = 0; corner < 8; ++corner)
      for (int j = 0; j < 3; ++j) {
        double slope = 1;
        for (int c = 0; c < 3; ++c) {
          const bool far = (corner >> c & 1) != 0;
          slope *= c == j ? (far ? 1 : -1) / size[c] : far ? t[c] : 1 - t[c];
        }
        for (int i = 0; i < 3; ++i) g[3 * corner + i][i][j] = slope;
      }
    for (int a = 0; a < 24; ++a) {
      const double trace_a = g[a][0][0] + g[a][1][1] + g[a][2][2];
      divergence[a] += trace_a * w;
      for (int b = 0; b < 24; ++b) {
        const double trace_b = g[b][0][0] + g[b][1][1] + g[b][2][2];
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) {
            const double e = (g[a][i][j] + g[a][j][i]) / 2 - (i == j ? trace_a / 3 : 0);
            const double f = (g[b][i][j] + g[b][j][i]) / 2 - (i == j ? trace_b / 3 : 0);
            k[a][b] += 2 * mu * e * f * w;
          }
      }
    }
  }
  for (int a = 0; a < 24; ++a)
    for (int b = 0; b < 24; ++b) k[a][b] += kappa * divergence[a] * divergence[b] / volume;
  return k;
}

class ForwardEquations {
 public:
  ForwardEquations(const fem::CellGrid& grid, double poisson) : grid_(grid) {
    const auto nodes = static_cast<int>(grid.nodes());
    std::vector<Eigen::Triplet<double>> entries;
    for (uint32_t k = 0; k < grid.cells[2]; ++k) {
      if (grid.slit == k) continue;
      const auto element = brick({grid.size_x_mm, grid.size_y_mm, grid.size_z_mm[k]}, poisson);
      for (uint32_t j = 0; j < grid.cells[1]; ++j)
        for (uint32_t i = 0; i < grid.cells[0]; ++i)
          for (uint32_t a = 0; a < 24; ++a)
            for (uint32_t b = 0; b < 24; ++b) {
              const auto at = [&](uint32_t row) {
                const uint32_t corner = row / 3;
                return static_cast<int>(row % 3) * nodes +
                       static_cast<int>(
                           grid.node(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)));
              };
              entries.emplace_back(at(a), at(b), element[a][b] * double{grid.young[grid.cell(i, j, k)]});
            }
    }
    matrix_.resize(3 * nodes, 3 * nodes);
    matrix_.setFromTriplets(entries.begin(), entries.end());
  }

  std::vector<double> forces(const std::vector<double>& displacement) const {
    const Eigen::VectorXd f = matrix_ * Eigen::Map<const Eigen::VectorXd>(
                                            displacement.data(), static_cast<int>(displacement.size()));
    return {f.data(), f.data() + f.size()};
  }

  /// Displacements under a load; what is fixed keeps its value in `displacement`. Both sides of a slit have
  /// one unknown along z.
  void solve(const fem::FixedNodes& fixed, const std::vector<double>& load,
             std::vector<double>& displacement) const {
    const size_t nodes = grid_.nodes();
    std::vector<int> unknown(3 * nodes, -1);
    int count = 0;
    const size_t plane = size_t{grid_.cells[0] + 1} * (grid_.cells[1] + 1);
    const size_t lower = grid_.slit ? 2 * nodes + (*grid_.slit + 1) * plane : 3 * nodes;
    for (size_t n = 0; n < 3 * nodes; ++n)
      if ((fixed[n % nodes] >> (n / nodes) & 1) == 0) {
        unknown[n] = n >= lower && n < lower + plane ? unknown[n - plane] : count++;
        displacement[n] = 0;
      }
    const std::vector<double> held = forces(displacement);
    std::vector<Eigen::Triplet<double>> entries;
    for (int column = 0; column < matrix_.outerSize(); ++column)
      for (Eigen::SparseMatrix<double>::InnerIterator it(matrix_, column); it; ++it)
        if (unknown[it.row()] >= 0 && unknown[column] >= 0)
          entries.emplace_back(unknown[it.row()], unknown[column], it.value());
    Eigen::SparseMatrix<double> free(count, count);
    free.setFromTriplets(entries.begin(), entries.end());
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    for (size_t n = 0; n < 3 * nodes; ++n)
      if (unknown[n] >= 0) right(unknown[n]) += load[n] - held[n];
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(free);
    if (factor.info() != Eigen::Success) throw std::runtime_error("the reference's matrix is singular");
    const Eigen::VectorXd found = factor.solve(right);
    for (size_t n = 0; n < 3 * nodes; ++n)
      if (unknown[n] >= 0) displacement[n] = found(unknown[n]);
  }

 private:
  const fem::CellGrid& grid_;
  Eigen::SparseMatrix<double> matrix_;
};

}  // namespace palpate::reference
