// The inner loops of the stiffness product, made for the widest vectors that the processor has.
#pragma once

#include "engine/fem/linear/grid.h"

namespace palpate::fem {

/// Numbers of one layer of cells. In the basis 1, x, y, z, xy, xz, yz, xyz of the cell the element matrix is
/// almost diagonal: a cell costs some 150 additions and multiplications instead of 576.
template <typename Real>
struct LayerStiffness {
  Real bulk;                    ///< (kappa - 2 mu / 3) V / 64
  Real twice_mu;                ///< 2 mu V / 64
  Real gx, gy, gz;              ///< 2 / size
  Real xx, yy, zz, xy, xz, yz;  ///< mu V / 64 g g
};

/// Adds what layer k of cells does to its upper plane of nodes (`upper`) and its lower one.
void add_layer(const LayerStiffness<float>& stiffness, const CellGrid& grid, uint32_t k,
               const float* displacement, float* force, bool upper, bool lower);
void add_layer(const LayerStiffness<double>& stiffness, const CellGrid& grid, uint32_t k,
               const double* displacement, double* force, bool upper, bool lower);

}  // namespace palpate::fem
