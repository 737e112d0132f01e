// A press at large strain: its loads, how it is solved, and what it answers.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/stop.h"
#include "engine/fem/large_strain/fitted_grid.h"
#include "engine/fem/scene.h"

namespace palpate::fem {

/// Where a press is to be looked at: at a way of the plate, or at a force. Exactly one of the two.
struct PressLoad {
  std::optional<double> press_mm;  ///< > 0, less than half of the block with its pad
  std::optional<double> force_N;   ///< > 0
};

struct LargeStrainOptions {
  double residual = 1e-6;  ///< forces out of balance over all forces, 1e-10 to 1e-2
  double step_mm = 0.5;    ///< of the press, at most; cut where Newton's search does not end
  uint32_t most_cuts = 6;  ///< halvings of one step before the press is given up
  uint32_t threads = 0;    ///< 0: one per core
  /// Nodes of the pressure maps along x and y, first and last on the block's rim at rest; 0: the cells' own.
  std::array<uint32_t, 2> map_nodes = {0, 0};
  bool quarter = true;  ///< planes of symmetry that the scene has are used
  /// Cells of the scene's that follow its inclusion's surface as the inclusion's own. None: cells are
  /// straight bricks, and those on the border are as stiff as their fraction of both.
  std::optional<InclusionCells> lump_cells;
  /// Asked at each step, each round of Newton's search and each iteration within it; true: the press ends
  /// there. It may throw as well.
  StopAsked stop;
};

/// The block at one load.
struct PressedBlock {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double press_mm = 0;
  double force_N = 0;  ///< on the plate
  /// True pressure (force over deformed area) in the frame of the plate, its middle at the block's middle:
  /// what a sensor in the plate sees.
  Map pressure_Pa;
  Map deflection_mm;  ///< of the tissue's surface at its nodes, cells + 1; into the tissue counts up
  /// Error estimates by two grids (solve_extrapolated()): of the force (where a press was asked for), the
  /// press (where a force was) and the map, the map's as the RMS over its nodes. NaN from one grid, which
  /// gives none.
  double force_error_N = kUnknown, press_error_mm = kUnknown, pressure_error_Pa = kUnknown;
  double least_volume_ratio = 1;  ///< smallest det F at any quadrature point; an inverted element is an error
  double residual = 0;
};

/// The loads reached, in their order. Where `converged` is false the press ended before the last load;
/// `loads` holds those that are good, and the last good press and force say how far it came.
struct LargeStrainResult {
  bool converged = false;
  std::vector<PressedBlock> loads;
  double last_press_mm = 0, last_force_N = 0;
  uint32_t steps = 0, cuts = 0, newton_rounds = 0, iterations = 0;  ///< iterations: of conjugate gradients
  double wall_s = 0;
  uint64_t bytes = 0;
  bool follows_lump = false;  ///< the cells do
  /// From solve_extrapolated(), one per load: the order with which the rim's part of the force shrinks with
  /// the cells (see rim_error.h). Empty: not measured.
  std::vector<double> rim_order;
  std::vector<std::string> warnings;
};

}  // namespace palpate::fem
