// Error of the linear photometric normal, as a small smooth table over it (NormalTable in
// palpate/sensor.h).
#pragma once

#include <array>
#include <vector>

#include "palpate/sensor.h"

namespace palpate {

/// The table's value at a linear normal: bilinear between nodes; beyond the grid the edge's value plus what
/// lies beyond. The slope kernels do the same in single precision.
std::array<double, 2> corrected_normal(const NormalTable& table, double nx, double ny);

/// Least squares over pairs of linear and true normal. The correction's second differences are held down, its
/// size a little, and at the level normal it is 0: nodes that no pixel supports stay near the identity.
class NormalTableFit {
 public:
  /// `side` odd, 3 to 65; `reach` in (0, 1].
  NormalTableFit(uint32_t side, double reach);
  void add(double linear_x, double linear_y, double true_x, double true_y);
  /// `smoothing`: weight of the second differences relative to the mean support of a node.
  NormalTable solve(double smoothing = 1) const;

 private:
  uint32_t side_;
  double reach_;
  std::vector<double> gram_;  // side^2 nodes, each with itself and its eight neighbours
  std::vector<double> to_x_, to_y_;
  double samples_ = 0;
};

}  // namespace palpate
