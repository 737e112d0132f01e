// Capacitance matrix: the least-squares surface of a part of the grid from a solver of the whole grid
// (Buzbee, Dorr, George and Golub, SIAM J. Numer. Anal. 8 (1971) 722).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace palpate {

/// Weights of the faces between the cells of a grid: `across[i]` of cell i's right face, `down[i]` of its
/// lower one, width x height each; 0 beyond the border and where nothing is known. `whole_across`,
/// `whole_down`: the same where everything is known.
struct CellFaces {
  uint32_t width = 0, height = 0;
  std::vector<float> across, down, whole_across, whole_down;
};

/// Faces of single pixels (`side` 1) or of cells of 2 x 2 px (`side` 2, the last of odd frames narrower):
/// what `known`, width x height pixels, not 0 where one is known, leaves of them. A pixel's face is known
/// where both its pixels are.
CellFaces faces_of_known(std::span<const uint8_t> known, uint32_t width, uint32_t height, uint32_t side);

/// A known cell of which some face is missing, and the weights of those faces.
struct EdgeCell {
  uint32_t x = 0, y = 0;
  float left = 0, right = 0, up = 0, down = 0;
};

/// Let z solve A z = b on the whole grid, b being of the known faces only. What flows through the missing
/// faces of an edge cell, m = sum of weight (z - neighbour's z), is what the known part's equation there
/// leaves. Sources M m on the edge cells, added to b, make the whole grid's solution that of the known part
/// within it; beyond, it goes on harmonically. Exact for grids of equal cells; where the last row or column
/// is narrower a small fraction of m remains. Again for a solution with sources s: M (m - s) more of them.
struct Capacitance {
  uint32_t islands = 0;  ///< parts that no known face joins
  std::vector<EdgeCell> cells;
  std::vector<float> sources;  ///< M: cells x cells, row by row
};

/// More edge cells would take seconds to prepare and more memory than a frame.
inline constexpr size_t kMostEdgeCells = 2048;

/// Without edge cells where nothing is missing; nothing where they are too many.
std::optional<Capacitance> capacitance(const CellFaces& faces);

}  // namespace palpate
