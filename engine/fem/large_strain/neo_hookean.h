// Nearly incompressible neo-Hookean bricks at large strain: their forces, and how these change.
//
// Energy of a cell of volume V at rest: mu/2 sum_q w_q (J^(-2/3) I1 - 3) + kappa/2 V (Jm - 1)^2 over eight
// Gauss points q, with F = 1 + grad u, J = det F, I1 = F : F and Jm the cell's mean of J (Q1-P0: a J of each
// point's own locks). Small displacements of bricks answer as Stiffness's.
#pragma once

#include <array>
#include <vector>

#include "engine/base/work_team.h"
#include "engine/fem/large_strain/neo_hookean_layer.h"
#include "engine/fem/linear/grid.h"

namespace palpate::fem {

class NeoHookeanCells {
 public:
  /// Keeps a reference to the grid, which has no slit and outlives it.
  NeoHookeanCells(const CellGrid& grid, double poisson);

  /// Inner forces of a displacement on all nodes, 3 x nodes each, in modulus times mm^2: the derivatives of
  /// the energy. `young`: moduli of the cells, the grid's or others (forces are proportional to them). Only
  /// layers [first, last) act. Returns the smallest J of all points.
  double forces(const double* displacement, double* force, const std::vector<float>& young, WorkTeam& team,
                uint32_t first = 0, uint32_t last = ~0u) const;

  /// Takes the energy's second derivatives at a displacement for apply(). 1296 bytes a cell. The part of them
  /// that is proportional to the cells' pressure kappa (Jm - 1) takes it from `pressure` instead, one of each
  /// cell in the modulus' unit: at large kappa a displacement that is only nearly right has a pressure that
  /// is far off.
  void form_tangent(const double* displacement, const std::vector<double>& pressure, WorkTeam& team);

  /// Pressures of a displacement to first order in its change: kappa (Jm + dJm - 1).
  void pressures(const double* displacement, const double* change, std::vector<double>& pressure,
                 WorkTeam& team) const;

  /// force = K displacement. `fixed`: as Stiffness::apply.
  void apply(const double* displacement, double* force, const FixedNodes* fixed, WorkTeam& team) const;

  uint64_t bytes() const { return tangent_.size() * sizeof(float); }

 private:
  template <typename Shapes>
  friend struct NeoHookeanForces;
  template <typename Shapes>
  friend struct NeoHookeanTangent;
  template <typename Shapes>
  friend struct NeoHookeanPressure;
  /// Work on one layer for bricks or for bent cells, whichever the grid has.
  template <template <typename> class Work, typename... Parts>
  void run_on_shapes(const Parts&... parts) const;

  const CellGrid& grid_;
  double mu_, kappa_;  ///< of Young's modulus 1
  std::vector<NeoHookeanLayer> layers_;
  uint32_t blocks_;             ///< of eight cells along a row
  std::vector<float> tangent_;  ///< per block: 36 pairs of corners x 9 entries x 8 cells
};

}  // namespace palpate::fem
