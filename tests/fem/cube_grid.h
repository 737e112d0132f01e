// Grids made by hand for tests.
#pragma once

#include "engine/fem/linear/solver.h"

namespace palpate {

/// Cube of even cells with a modulus of 1.
inline fem::CellGrid cube(uint32_t cells, double pitch_mm) {
  fem::CellGrid grid;
  grid.cells = {cells, cells, cells};
  grid.size_x_mm = grid.size_y_mm = pitch_mm;
  grid.size_z_mm.assign(cells, pitch_mm);
  grid.young.assign(grid.cell_count(), 1);
  return grid;
}

}  // namespace palpate
