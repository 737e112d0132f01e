// Presses of lumps on all grids of a direct inversion, each starting from what is known: the next coarser
// grid's answer, or the last lump's in the same cells.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "engine/fem/large_strain/grid_press.h"
#include "engine/lump/fem_inverse/effort.h"
#include "engine/lump/fem_inverse/response.h"

namespace palpate::lump {

/// Grids that are asked about a lump: the one that is searched alone, those coarser than it too, or all.
/// Where none is coarser, Coarse asks all.
enum class AskedGrids : uint8_t { Searched, Coarse, All };

/// Answer of the grids about a lump.
struct GridAnswer {
  std::optional<Case::Lump> lump;  ///< that was pressed: in the middle where that makes no difference
  Eigen::VectorXd searched_Pa;     ///< of the grid that is searched
  GridCorrection correction;       ///< between it and cells of no size
  bool of_all = false;             ///< all grids were asked
};

class GridSeries {
 public:
  /// Keeps all three.
  GridSeries(const ComparedNodes& nodes, const ResponseOptions& options, Effort& effort)
      : nodes_(nodes), options_(options), effort_(effort) {}

  /// Presses tissue alone on all grids, whatever effort is left. None where there is no equilibrium. Throws
  /// as solve_large_strain(), and Stopped.
  std::optional<GridAnswer> tissue() { return ask(std::nullopt, AskedGrids::All, nullptr); }
  /// Presses a lump; grids finer than the one that is searched at every second load, of three and more: what
  /// they differ by there leads to the other loads. What grids would say that are not asked is taken from
  /// `known`, another lump's correction, null for none: without it the coarser grids lead to cells of no
  /// size. None where there is no equilibrium, the cells cannot follow the lump, or all effort is spent.
  /// Throws as tissue().
  std::optional<GridAnswer> lump(const FittedLump& lump, AskedGrids grids, const GridCorrection* known) {
    return ask(lump, grids, known);
  }

 private:
  struct Pressed {
    Eigen::VectorXd values;
    fem::GridPress press;
  };
  std::optional<GridAnswer> ask(const std::optional<FittedLump>& lump, AskedGrids grids,
                                const GridCorrection* known);
  std::vector<uint32_t> asked(AskedGrids grids) const;
  /// From the values of the first grids, `known` as lump().
  GridCorrection correction_of(const std::vector<Eigen::VectorXd>& values, const Eigen::VectorXd& searched_Pa,
                               const GridCorrection* known) const;
  /// On one grid: from the last lump of the same shape and cells, else from a coarser grid, else from rest.
  std::optional<Pressed> press(const std::optional<FittedLump>& lump, uint32_t times,
                               const std::vector<double>& force_N, const fem::GridPress* coarser);

  /// States that the last lump of a shape left on one grid.
  struct Last {
    fem::InclusionCells cells;
    fem::GridPress press;
  };
  struct LastOf {
    uint32_t times;
    InclusionShape shape;
    bool along_y;
    bool operator<(const LastOf& other) const {
      return std::tie(times, shape, along_y) < std::tie(other.times, other.shape, other.along_y);
    }
  };
  const ComparedNodes& nodes_;
  const ResponseOptions& options_;
  Effort& effort_;
  std::map<LastOf, Last> last_;
};

}  // namespace palpate::lump
