// Coverage, error and verdicts by cell: two conditions at a time, with exact binomial bands, and the worst
// cell by name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/lab/judge/binomial.h"
#include "perf/lab/judge/cases.h"

namespace palpate::judge {

struct CellOptions {
  std::vector<std::string> by =
      {};                   ///< conditions to cross, each with each; one alone: by it only; empty: all
  size_t bins = 4;          ///< of a condition's numbers, as many cases in each; 1 to 20
  size_t fewest = 20;       ///< of a cell that is judged; those with less are shown as too few
  double level = 0.9;       ///< of the bands
  double accuse_at = 0.05;  ///< how often an estimator that keeps its promise is accused all the same
  uint64_t seed = 1;        ///< of the draws behind that
};

/// One side of a grid: the steps of a condition.
struct Axis {
  size_t condition = 0;
  std::vector<double> edges;        ///< one more than there are steps; step i is [edge i, edge i + 1)
  std::vector<std::string> labels;  ///< of the steps, for people
  size_t size() const { return labels.size(); }
  /// None where the number lies in no step.
  std::optional<size_t> step_of(double value) const;
};

/// A quantity's intervals in one cell: of reported cases that state one.
struct Coverage {
  size_t judged = 0, inside = 0;
  Band band;                ///< of inside / judged
  double median_error = 0;  ///< relative, |value / truth - 1|; NaN: of no case
  double ninetieth_error = 0;
  double chance = 1;     ///< of so few inside, or fewer, in any one of the cells if the promise held in all
  bool too_few = true;   ///< judged < CellOptions::fewest: neither accused nor named
  bool accused = false;  ///< chance <= CellOptions::accuse_at
  double rate() const;   ///< inside / judged; NaN: of none
};

struct Cell {
  size_t count = 0, refused = 0, wrong = 0;
  Band refused_band, wrong_band;  ///< of refused / count and of wrong / reported
  std::vector<Coverage> quantities;
  size_t reported() const { return count - refused; }
};

/// Cells of one pair of conditions, row by row of `y`; of one condition alone `y` has one step, "all".
struct Grid {
  Axis x, y;
  bool single = false;
  std::vector<Cell> cells;
  const Cell& at(size_t i, size_t j) const { return cells[j * x.size() + i]; }
};

struct Place {
  size_t grid = 0, x = 0, y = 0;
};

struct Judgement {
  CellOptions options;
  std::vector<Condition> conditions;
  std::vector<Quantity> quantities;
  std::string wrong_means;
  Cell all;      ///< every case
  Cell outside;  ///< cases that lack a condition which the grids use
  std::vector<Grid> grids;
  std::vector<std::optional<Place>> worst;  ///< of each quantity; none: every cell has too few
  std::optional<Place> worst_wrong;         ///< none: no verdict was wrong, or too few everywhere

  const Cell& cell(const Place& place) const { return grids[place.grid].at(place.x, place.y); }
};

/// Cuts conditions of at most `bins` + 2 different numbers (or with labels) into these, others into `bins`
/// steps of about as many cases.
///
/// Accused is a cell whose count of intervals that hold would be so low, in any one of all cells of the
/// quantity, with a chance of at most `accuse_at` if each interval held by itself as often as promised. The
/// chance comes from 999 draws of all cases together, so that cells of several grids, which share cases, and
/// small counts are allowed for; cases of one
/// group are drawn as one, while bands take all cases as independent. The worst cell is the one whose band's
/// upper end is the lowest: of those accused, or where none is of all that are judged. A band's upper end is
/// high where cases are few, so that the smallest cell is not the worst by chance. The worst verdicts are
/// those whose band of wrong ones has the highest lower end.
///
/// Throws Error(Failure::Usage) on a condition that there is not or that no case has, and on options out of
/// range; of no case at all Error(Failure::Input).
Judgement judge_cells(const Cases& cases, const CellOptions& options);

/// "size_mm 2 to 4, depth_mm 8 to 12".
std::string name_of(const Judgement& judgement, const Place& place);

}  // namespace palpate::judge
