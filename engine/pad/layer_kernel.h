// Displacements of a pad's surface by a load on one cell of a grid: the Green's functions of the reading
// `elastic`, whose cells are pixels, and of the traction solve. Pressure acts into the pad, shear traction
// along x and y.
#pragma once

#include <vector>

#include "engine/pad/pad.h"

namespace palpate {

/// Integral of 1/r over a cell of side 1 whose middle lies (dx, dy) cells away (A. E. H. Love, Phil. Trans.
/// R. Soc. A 228 (1929) 377): finite over the cell itself, 4 ln(1 + sqrt 2).
double love_cell(double dx, double dy);

/// At a place, mm, by 1 MPa on a cell. x by shear along y is y_by_x; depth by shear along x is minus
/// x_by_pressure, along y minus y_by_pressure.
struct CellAnswer {
  double depth = 0;  ///< by pressure
  double x_by_pressure = 0, y_by_pressure = 0;
  double x_by_x = 0, y_by_x = 0, y_by_y = 0;  ///< by shear
};

/// Boussinesq's and Cerruti's half space, integrated over the cell in closed form, less what the finite
/// thickness takes away (Hankel transforms of layer_response.h).
class LayerKernel {
 public:
  /// Throws Error(Failure::Input) outside the ranges of Material, and on an infinite modulus, a thickness or
  /// a cell that is not > 0, a base that is not bonded.
  LayerKernel(const Pad& pad, double cell_mm);

  /// (dx, dy) cells from the middle of the loaded one.
  CellAnswer at(double dx, double dy) const;
  /// CellAnswer::depth alone.
  double depth(double dx, double dy) const;

  /// Scale of depth: mm per MPa and per cell of 1/r.
  double depth_scale_mm_per_MPa() const { return (1 - poisson_) * scale_mm_per_MPa_; }
  /// Reduction of 1/r by the finite thickness at r cells, 1/cell.
  double depth_loss(double r_cells) const;
  /// Infinite for a half space.
  double thickness_cells() const { return thickness_cells_; }

 private:
  /// In units of 1 / (2 pi G H), at r / H: of depth by pressure; of shift by shear, the part that is the same
  /// in every direction and the one that goes with twice the angle; of shift by pressure.
  struct Loss {
    double depth = 0, even = 0, twofold = 0, coupling = 0;
  };
  Loss loss(double r_over_thickness) const;
  template <typename Take>
  double over_cell(double dx, double dy, const Take& take) const;

  double poisson_;
  double scale_mm_per_MPa_;  ///< cell / (2 pi G)
  double thickness_cells_;
  std::vector<Loss> table_;  ///< empty for a half space
};

}  // namespace palpate
