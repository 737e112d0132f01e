#include "engine/fem/linear/stiffness.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/numeric/dense.h"

namespace palpate::fem {
namespace {

struct Moduli {
  double mu, kappa;  // of Young's modulus 1
};
Moduli moduli(double poisson) {
  return {0.5 / (1 + poisson), 1 / (3 * (1 - 2 * poisson))};
}

template <typename Real>
LayerStiffness<Real> layer_stiffness(const std::array<double, 3>& size, double poisson) {
  const auto [mu, kappa] = moduli(poisson);
  const double v = size[0] * size[1] * size[2] / 64;
  const double gx = 2 / size[0], gy = 2 / size[1], gz = 2 / size[2], m = mu * v;
  const auto real = [](double x) { return static_cast<Real>(x); };
  return {real((kappa - 2 * mu / 3) * v),
          real(2 * m),
          real(gx),
          real(gy),
          real(gz),
          real(m * gx * gx),
          real(m * gy * gy),
          real(m * gz * gz),
          real(m * gx * gy),
          real(m * gx * gz),
          real(m * gy * gz)};
}

}  // namespace

std::array<double, 576> element_matrix(const std::array<double, 3>& size, double poisson) {
  using Matrix = Eigen::Matrix<double, 24, 24>;
  const auto [mu, kappa] = moduli(poisson);
  const double volume = size[0] * size[1] * size[2];
  Matrix k = Matrix::Zero();
  Eigen::Matrix<double, 24, 1> mean = Eigen::Matrix<double, 24, 1>::Zero();
  // Two Gauss points a side integrate products of trilinear gradients exactly.
  const double gauss = 1 / std::sqrt(3.0);
  for (int point = 0; point < 8; ++point) {
    const double at[3] = {point & 1 ? gauss : -gauss, point & 2 ? gauss : -gauss, point & 4 ? gauss : -gauss};
    Eigen::Matrix<double, 6, 24> strain = Eigen::Matrix<double, 6, 24>::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      double sign[3], gradient[3];
      for (int c = 0; c < 3; ++c) sign[c] = corner >> c & 1 ? 1 : -1;
      for (int c = 0; c < 3; ++c) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        gradient[c] = sign[c] * (1 + sign[a] * at[a]) * (1 + sign[b] * at[b]) / (4 * size[c]);
      }
      const int x = 3 * corner, y = x + 1, z = x + 2;
      strain(0, x) = gradient[0];
      strain(1, y) = gradient[1];
      strain(2, z) = gradient[2];
      strain(3, x) = gradient[1];
      strain(3, y) = gradient[0];
      strain(4, x) = gradient[2];
      strain(4, z) = gradient[0];
      strain(5, y) = gradient[2];
      strain(5, z) = gradient[1];
    }
    Eigen::Matrix<double, 6, 6> deviatoric = Eigen::Matrix<double, 6, 6>::Zero();
    deviatoric.topLeftCorner<3, 3>().setConstant(-2 * mu / 3);
    deviatoric.diagonal() << 4 * mu / 3, 4 * mu / 3, 4 * mu / 3, mu, mu, mu;
    k += strain.transpose() * deviatoric * strain * (volume / 8);
    mean += strain.topRows<3>().colwise().sum().transpose() / 8;
  }
  k += kappa * volume * mean * mean.transpose();
  std::array<double, 576> out;
  std::copy(k.data(), k.data() + 576, out.begin());  // symmetric: the order of its storage does not matter
  return out;
}

double element_bound(const std::array<double, 3>& size, double poisson, bool at_slit) {
  const std::array<double, 576> values = element_matrix(size, poisson);
  const Eigen::MatrixXd k = Eigen::Map<const Eigen::Matrix<double, 24, 24>>(values.data());
  Eigen::MatrixXd blocks = Eigen::MatrixXd::Zero(24, 24);
  for (int corner = 0; corner < 8; ++corner)
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (!at_slit || (a == 2) == (b == 2))
          blocks(3 * corner + a, 3 * corner + b) = k(3 * corner + a, 3 * corner + b);
  return dense::generalized_eigenvalues(k, blocks)(23);
}

Stiffness::Stiffness(const CellGrid& grid, double poisson) : grid_(grid), poisson_(poisson) {
  for (uint32_t k = 0; k < grid.cells[2]; ++k) {
    if (grid.slit == k) {
      single_.push_back({});
      double_.push_back({});
      continue;
    }
    single_.push_back(layer_stiffness<float>(cell_size_mm(k), poisson));
    double_.push_back(layer_stiffness<double>(cell_size_mm(k), poisson));
  }
}

template <typename Real>
void Stiffness::apply_as(const std::vector<LayerStiffness<Real>>& layers, const Real* displacement,
                         Real* force, const FixedNodes* fixed, WorkTeam& team) const {
  const size_t plane = size_t{grid_.cells[0] + 1} * (grid_.cells[1] + 1), nodes = grid_.nodes();
  team.run([&](uint32_t part) {
    const auto [begin, end] = team.share(grid_.cells[2] + 1, part);
    if (begin == end) return;
    for (size_t c = 0; c < 3; ++c)
      std::memset(force + c * nodes + begin * plane, 0, (end - begin) * plane * sizeof(Real));
    // The layer between two parts is worked through by both, each keeping its own plane of nodes.
    for (uint32_t k = begin == 0 ? 0 : begin - 1; k < std::min(end, grid_.cells[2]); ++k)
      if (grid_.slit != k) add_layer(layers[k], grid_, k, displacement, force, k >= begin, k + 1 < end);
    if (fixed == nullptr) return;
    const uint8_t* bits = fixed->data();
    for (size_t c = 0; c < 3; ++c) {
      const auto bit = static_cast<uint8_t>(1u << c);
      Real* f = force + c * nodes;
      for (size_t n = begin * plane; n < end * plane; ++n) f[n] = (bits[n] & bit) != 0 ? Real{0} : f[n];
    }
  });
  share_across_slit(grid_, force);
}

void Stiffness::apply(const float* displacement, float* force, const FixedNodes* fixed,
                      WorkTeam& team) const {
  apply_as(single_, displacement, force, fixed, team);
}

void Stiffness::apply(const double* displacement, double* force, const FixedNodes* fixed,
                      WorkTeam& team) const {
  apply_as(double_, displacement, force, fixed, team);
}

void Stiffness::apply_layers(const double* displacement, double* force, uint32_t first, uint32_t last) const {
  std::fill_n(force, 3 * grid_.nodes(), 0.0);
  for (uint32_t k = first; k < last; ++k)
    if (grid_.slit != k) add_layer(double_[k], grid_, k, displacement, force, true, true);
}

std::vector<float> Stiffness::inverse_blocks(const FixedNodes& fixed) const {
  const size_t nodes = grid_.nodes();
  const auto [nx, ny, nz] = grid_.cells;
  std::vector<float> inverse(6 * nodes);
  std::vector<std::array<double, 576>> element;
  for (uint32_t k = 0; k < nz; ++k)
    element.push_back(grid_.slit == k ? std::array<double, 576>{}
                      : k > 0 && grid_.size_z_mm[k] == grid_.size_z_mm[k - 1]
                          ? element.back()
                          : element_matrix(cell_size_mm(k), poisson_));
  const auto diagonal_block = [&, nx = nx, ny = ny, nz = nz](uint32_t i, uint32_t j, uint32_t k) {
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
    for (uint32_t corner = 0; corner < 8; ++corner) {
      // This node is that corner of the cell at (i, j, k) less the corner's place.
      const uint32_t x = i - (corner & 1), y = j - (corner >> 1 & 1), z = k - (corner >> 2);
      if (x >= nx || y >= ny || z >= nz) continue;
      const Eigen::Map<const Eigen::Matrix<double, 24, 24>> e(element[z].data());
      block += double{grid_.young[grid_.cell(x, y, z)]} *
               e.block<3, 3>(3 * static_cast<int>(corner), 3 * static_cast<int>(corner));
    }
    return block;
  };
  for (uint32_t k = 0; k <= nz; ++k)
    for (uint32_t j = 0; j <= ny; ++j)
      for (uint32_t i = 0; i <= nx; ++i) {
        Eigen::Matrix3d block = diagonal_block(i, j, k);
        if (grid_.slit && (k == *grid_.slit || k == *grid_.slit + 1)) {
          // Both sides of the slit take the same step along z, whatever they do along x and y.
          const uint32_t across = k == *grid_.slit ? k + 1 : k - 1;
          block(2, 2) = (block(2, 2) + diagonal_block(i, j, across)(2, 2)) / 2;
          block(0, 2) = block(2, 0) = block(1, 2) = block(2, 1) = 0;
        }
        const size_t n = grid_.node(i, j, k);
        for (int c = 0; c < 3; ++c)
          if ((fixed[n] >> c & 1) != 0) {
            block.row(c).setZero();
            block.col(c).setZero();
            block(c, c) = 1;
          }
        Eigen::Matrix3d inverted = block.inverse();
        for (int c = 0; c < 3; ++c)
          if ((fixed[n] >> c & 1) != 0) inverted(c, c) = 0;
        const double six[] = {inverted(0, 0), inverted(1, 1), inverted(2, 2),
                              inverted(0, 1), inverted(0, 2), inverted(1, 2)};
        for (size_t s = 0; s < 6; ++s) inverse[s * nodes + n] = static_cast<float>(six[s]);
      }
  return inverse;
}

}  // namespace palpate::fem
