// A layer under pressure that does not end with the grid: what presses in the outermost cells goes on as it
// is for some way beyond. Of a contact that a frame cuts off; without it those cells carry what lies outside
// as well.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/pad/layer_convolution.h"

namespace palpate {

/// Load of a cell and of what goes on from it beyond the border, for a unit of pressure.
struct CarriedLoad {
  double cells = 1;                 ///< that carry it
  double x_cells = 0, y_cells = 0;  ///< sums over them of how far from the cell they lie
};

/// Memory is made once; not thread safe. Maps are height x width.
class LayerContinuation {
 public:
  /// `margin`: cells beyond each border. `shear`: shift_by_pressure() is wanted.
  LayerContinuation(const LayerKernel& kernel, uint32_t width, uint32_t height, uint32_t margin, bool shear);

  /// The most that a contact is taken to go on: a thickness; no more than half of the grid, where the layer
  /// is thick.
  static uint32_t margin_cells(const LayerKernel& kernel, uint32_t width, uint32_t height);

  bool has_shear() const { return layer_.has_shear(); }

  /// How far pressure goes on, cells, from 0 up to the margin.
  void set_reach(double cells);
  const std::vector<CarriedLoad>& carried() const { return carried_; }

  /// Depth in the grid, mm, by pressure in it and beyond, MPa.
  void depth_by_pressure(const std::vector<double>& pressure, std::vector<double>& depth);
  /// Its transpose.
  void pressure_by_depth(const std::vector<double>& depth, std::vector<double>& pressure);
  /// Shift along x and y, mm, by pressure in the grid and beyond.
  void shift_by_pressure(const std::vector<double>& pressure, std::vector<double>& x, std::vector<double>& y);

 private:
  void widen(const std::vector<double>& pressure);
  void crop(const std::vector<double>& from, std::vector<double>& to) const;

  LayerConvolution layer_;            ///< on the grid with its margin
  std::vector<uint32_t> nearest_;     ///< of each of its cells the grid's
  std::vector<uint32_t> inside_;      ///< of each of the grid's cells its own
  std::vector<double> share_;         ///< of its nearest cell's pressure that each carries
  std::vector<CarriedLoad> carried_;  ///< by each of the grid's cells
  double reach_ = -1;
  std::vector<double> wide_, answer_, other_answer_;  ///< kept so that frames allocate nothing
};

}  // namespace palpate
