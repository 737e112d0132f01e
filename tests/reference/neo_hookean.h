// The energy of a block of neo-Hookean bricks in plain loops, from its definition.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "engine/lump/forward_grid.h"

namespace palpate::reference {

/// Sum over the cells of mu/2 int (J^(-2/3) I1 - 3) + kappa/2 V (Jm - 1)^2, Jm the mean of J; two Gauss
/// points a side. In modulus times mm^3.
inline double neo_hookean_energy(const ForwardGrid& grid, double poisson, const std::vector<double>& u) {
  const double mu = 0.5 / (1 + poisson), kappa = 1 / (3 * (1 - 2 * poisson));
  const double place[2] = {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)};
  double energy = 0;
  for (uint32_t k = 0; k < grid.cells[2]; ++k)
    for (uint32_t j = 0; j < grid.cells[1]; ++j)
      for (uint32_t i = 0; i < grid.cells[0]; ++i) {
        const std::array<double, 3> size = {grid.size_x_mm, grid.size_y_mm, grid.size_z_mm[k]};
        const double volume = size[0] * size[1] * size[2], young = double{grid.young[grid.cell(i, j, k)]};
        double shear = 0, mean = 0;
        for (int point = 0; point < 8; ++point) {
          const std::array<double, 3> t = {place[point & 1], place[point >> 1 & 1], place[point >> 2]};
          Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
          for (uint32_t corner = 0; corner < 8; ++corner) {
            const size_t n = grid.node(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
            for (int c = 0; c < 3; ++c) {
              double slope = 1;
              for (int d = 0; d < 3; ++d) {
                const bool far = (corner >> d & 1) != 0;
                slope *= d == c ? (far ? 1 : -1) / size[d] : far ? t[d] : 1 - t[d];
              }
              for (int r = 0; r < 3; ++r) f(r, c) += u[r * grid.nodes() + n] * slope;
            }
          }
          const double volume_ratio = f.determinant();
          shear += (std::pow(volume_ratio, -2.0 / 3) * f.squaredNorm() - 3) / 8;
          mean += volume_ratio / 8;
        }
        energy += young * volume * (mu / 2 * shear + kappa / 2 * (mean - 1) * (mean - 1));
      }
  return energy;
}

}  // namespace palpate::reference
