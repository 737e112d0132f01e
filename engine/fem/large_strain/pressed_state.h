// Equilibria of a block on one grid as starts of searches on others.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace palpate::fem {

/// Where a block stands at a way of the plate.
struct PressedState {
  double press_mm = 0;
  std::vector<double> displacement;  ///< mm, of all nodes, as CellGrid has vector fields
  std::vector<double> pressure;      ///< of the cells, over the tissue's modulus

  /// Adds `factor` times another state of the same grid: linear in all three.
  void add(double factor, const PressedState& other);
  void scale(double factor);
};

/// The state on a grid of so many cells, of one with so many others over the same part of the block:
/// displacements linear between nodes, pressures of the cell that holds the new cell's middle. Cells of both
/// are multiples of common ones between whose planes the lump's surface does not pass.
PressedState on_cells(const PressedState& state, const std::array<uint32_t, 3>& from,
                      const std::array<uint32_t, 3>& to);

}  // namespace palpate::fem
