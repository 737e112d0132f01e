// Stiffness of a grid of bricks without its matrix: trilinear elements, full quadrature for the deviatoric
// part of the strain and the cell's mean for the divergence (equal to Q1-P0; full quadrature of both locks:
// +2.5 % force at nu = 0.495, +44 % at 0.4999).
#pragma once

#include <array>
#include <vector>

#include "engine/base/work_team.h"
#include "engine/fem/linear/grid.h"
#include "engine/fem/linear/stiffness_row.h"

namespace palpate::fem {

/// Element matrix of a brick of unit modulus, 24 x 24: row and column 3 * corner + component, corner = x + 2
/// y
/// + 4 z of its place. Force, in modulus times mm, of displacements in mm; a cell's own is its modulus times
/// this.
std::array<double, 576> element_matrix(const std::array<double, 3>& size_mm, double poisson);

/// Bound of the largest eigenvalue of a grid's matrix after scaling by its 3 x 3 diagonal blocks: that of the
/// element, so it holds for all moduli and supports. Met by the checkerboard of a homogeneous grid.
/// `at_slit`: of blocks whose z stands by itself.
double element_bound(const std::array<double, 3>& size_mm, double poisson, bool at_slit = false);

class Stiffness {
 public:
  /// Keeps a reference to the grid's moduli: the grid outlives the operator.
  Stiffness(const CellGrid& grid, double poisson);

  /// force = K displacement, each 3 x nodes. `fixed`: forces of fixed displacements are zero instead; null:
  /// all are kept, so those of fixed ones are the reactions. Across a slit displacements along z are the same
  /// on both sides, and each side gets half of their force.
  void apply(const float* displacement, float* force, const FixedNodes* fixed, WorkTeam& team) const;
  void apply(const double* displacement, double* force, const FixedNodes* fixed, WorkTeam& team) const;
  /// The same from the layers of cells [first, last) alone: what they do to the nodes between.
  void apply_layers(const double* displacement, double* force, uint32_t first, uint32_t last) const;

  /// Inverses of the 3 x 3 diagonal blocks (along a slit, of x and y and of z by themselves), six numbers of
  /// each node: xx, yy, zz, xy, xz, yz, each of all nodes together. Rows and columns of fixed displacements
  /// are zero.
  std::vector<float> inverse_blocks(const FixedNodes& fixed) const;

  const CellGrid& grid() const { return grid_; }
  double poisson() const { return poisson_; }
  const LayerStiffness<double>& layer(uint32_t k) const { return double_[k]; }
  std::array<double, 3> cell_size_mm(uint32_t layer) const {
    return {grid_.size_x_mm, grid_.size_y_mm, grid_.size_z_mm[layer]};
  }

 private:
  template <typename Real>
  void apply_as(const std::vector<LayerStiffness<Real>>& layers, const Real* displacement, Real* force,
                const FixedNodes* fixed, WorkTeam& team) const;

  const CellGrid& grid_;
  double poisson_;
  std::vector<LayerStiffness<float>> single_;
  std::vector<LayerStiffness<double>> double_;
};

}  // namespace palpate::fem
