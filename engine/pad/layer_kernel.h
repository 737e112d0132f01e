// Displacements of a bonded layer's surface by traction on one cell of a grid: the Green's functions of the
// traction solve. Pressure acts into the layer, shear traction along x and y.
#pragma once

#include <vector>

#include "engine/elasticity/hertz.h"
#include "engine/elasticity/layer.h"

namespace palpate {

/// At a place, mm, by 1 MPa on a cell. x by shear along y is y_by_x; depth by shear along x is minus
/// x_by_pressure, along y minus y_by_pressure.
struct CellAnswer {
  double depth = 0;  ///< by pressure
  double x_by_pressure = 0, y_by_pressure = 0;
  double x_by_x = 0, y_by_x = 0, y_by_y = 0;  ///< by shear
};

/// Boussinesq's and Cerruti's half space, integrated over the cell in closed form, less what the finite
/// thickness takes away (Hankel transforms of engine/elasticity/layer_response.h).
class LayerKernel {
 public:
  /// Thickness 0: a half space. Throws Error(Failure::Input) outside the ranges of Material, and on an
  /// infinite modulus, a negative thickness or a cell <= 0.
  LayerKernel(const Material& layer, double thickness_mm, double cell_mm);

  /// (dx, dy) cells from the middle of the loaded one.
  CellAnswer at(double dx, double dy) const;

 private:
  /// In units of 1 / (2 pi G H), at r / H: of depth by pressure; of shift by shear, the part that is the same
  /// in every direction and the one that goes with twice the angle; of shift by pressure.
  struct Loss {
    double depth = 0, even = 0, twofold = 0, coupling = 0;
  };
  Loss loss(double r_over_thickness) const;

  double poisson_;
  double scale_mm_per_MPa_;     ///< cell / (2 pi G)
  double thickness_cells_ = 0;  ///< 0: a half space
  std::vector<Loss> table_;
};

}  // namespace palpate
