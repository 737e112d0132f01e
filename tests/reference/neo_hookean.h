// The energy of a block of neo-Hookean bricks in plain loops, from its definition.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "engine/fem/linear/grid.h"

namespace palpate::reference {

/// Where a corner of a cell lies at rest.
inline Eigen::Vector3d corner_place(const fem::CellGrid& grid, uint32_t i, uint32_t j, uint32_t k) {
  if (!grid.place_mm.empty()) {
    const size_t n = grid.node(i, j, k), nodes = grid.nodes();
    return {grid.place_mm[n], grid.place_mm[nodes + n], grid.place_mm[2 * nodes + n]};
  }
  double z = 0;
  for (uint32_t layer = 0; layer < k; ++layer) z += grid.size_z_mm[layer];
  return {i * grid.size_x_mm, j * grid.size_y_mm, z};
}

/// Sum over the cells of mu/2 int (J^(-2/3) I1 - 3) + kappa/2 V (Jm - 1)^2, Jm the mean of J over the cell's
/// volume; two Gauss points a side. In modulus times mm^3.
inline double neo_hookean_energy(const fem::CellGrid& grid, double poisson, const std::vector<double>& u) {
  const double mu = 0.5 / (1 + poisson), kappa = 1 / (3 * (1 - 2 * poisson));
  const double place[2] = {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)};
  double energy = 0;
  for (uint32_t k = 0; k < grid.cells[2]; ++k)
    for (uint32_t j = 0; j < grid.cells[1]; ++j)
      for (uint32_t i = 0; i < grid.cells[0]; ++i) {
        const double young = double{grid.young[grid.cell(i, j, k)]};
        double shear = 0, grown = 0, volume = 0;
        for (int point = 0; point < 8; ++point) {
          const std::array<double, 3> t = {place[point & 1], place[point >> 1 & 1], place[point >> 2]};
          Eigen::Matrix3d rest = Eigen::Matrix3d::Zero(), pressed = rest;  // per unit of the cell's own axes
          for (uint32_t corner = 0; corner < 8; ++corner) {
            const uint32_t x = i + (corner & 1), y = j + (corner >> 1 & 1), z = k + (corner >> 2);
            const size_t n = grid.node(x, y, z);
            Eigen::RowVector3d slope;
            for (int c = 0; c < 3; ++c) {
              slope(c) = 1;
              for (int d = 0; d < 3; ++d) {
                const bool far = (corner >> d & 1) != 0;
                slope(c) *= d == c ? (far ? 1 : -1) : far ? t[d] : 1 - t[d];
              }
            }
            const Eigen::Vector3d at = corner_place(grid, x, y, z);
            rest += at * slope;
            pressed += (at + Eigen::Vector3d(u[n], u[grid.nodes() + n], u[2 * grid.nodes() + n])) * slope;
          }
          const Eigen::Matrix3d f = pressed * rest.inverse();
          const double volume_ratio = f.determinant(), weight = rest.determinant() / 8;
          shear += weight * (std::pow(volume_ratio, -2.0 / 3) * f.squaredNorm() - 3);
          grown += weight * (volume_ratio - 1);
          volume += weight;
        }
        energy += young * (mu / 2 * shear + kappa / 2 * grown * grown / volume);
      }
  return energy;
}

}  // namespace palpate::reference
