// Presses of lumps on all grids of a direct inversion, each starting from what is known: the next coarser
// grid's answer, or the last lump's in the same cells.
#pragma once

#include <map>
#include <optional>

#include "engine/fem/large_strain/grid_press.h"
#include "engine/lump/fem_inverse/response.h"

namespace palpate::lump {

/// Answer of all grids about a lump.
struct GridAnswer {
  std::optional<Case::Lump> lump;  ///< that was pressed: in the middle where that makes no difference
  Eigen::VectorXd searched_Pa;     ///< of the grid that is searched
  GridCorrection correction;       ///< between it and cells of no size
};

class GridSeries {
 public:
  /// Keeps both.
  GridSeries(const ComparedNodes& nodes, const ResponseOptions& options) : nodes_(nodes), options_(options) {}

  /// Presses on all grids; `lump` empty: tissue alone. None where there is no equilibrium, or the cells
  /// cannot follow the lump. Throws as solve_large_strain().
  std::optional<GridAnswer> all(const std::optional<FittedLump>& lump);
  /// On the grid that is searched alone; the correction stays the other answer's.
  std::optional<GridAnswer> searched(const FittedLump& lump, const GridCorrection& correction);

 private:
  struct Pressed {
    Eigen::VectorXd values;
    fem::GridPress press;
  };
  /// On one grid: from the last lump of the same cells, else from a coarser grid, else from rest.
  std::optional<Pressed> press(const std::optional<FittedLump>& lump, uint32_t times,
                               const fem::GridPress* coarser);

  /// States that the last lump left on one grid.
  struct Last {
    Case::Lump lump;
    fem::InclusionCells cells;
    fem::GridPress press;
  };
  const ComparedNodes& nodes_;
  const ResponseOptions& options_;
  std::map<uint32_t, Last> last_;
};

}  // namespace palpate::lump
