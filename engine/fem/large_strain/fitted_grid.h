// A block whose cells follow the lump's surface: none of them is half lump and half tissue, so that errors
// shrink with the cells' square and answers change smoothly with the lump.
#pragma once

#include <array>
#include <optional>

#include "engine/fem/linear/grid.h"

namespace palpate::fem {

/// Cells [first, last) along x, y and z of a scene's whole grid that are the lump's own.
struct InclusionCells {
  std::array<uint32_t, 3> first{}, last{};

  InclusionCells times(uint32_t finer) const;
  /// Whether a quarter of so many cells represents the whole.
  bool in_middle(const std::array<uint32_t, 3>& of) const;
  bool operator==(const InclusionCells&) const = default;
};

/// Cells that have to be bent least to be the scene's inclusion: about as many as have its volume, two at
/// least along each side, two layers at least above (below a skin, which stays even: one) and one below. In
/// the block's middle, an even number of them, where the lump lies within a quarter of a cell of it.
InclusionCells inclusion_cells(const Scene& scene);
/// Whether cells that were chosen for another lump are within a cell of the best on each side.
bool matches(const InclusionCells& cells, const Scene& scene);

/// The scene with its inclusion in these cells: their outer faces lie on the inclusion's surface, scaled so
/// that they enclose its volume; what lies beyond gives way, and the block's faces keep an even grid. For a
/// scene without pad and without other inclusions. `quarter` as voxelise(), of cells in the block's
/// middle alone. None where a cell would be turned inside out, or a quarter does not represent the whole.
std::optional<CellGrid> fit(const Scene& scene, const InclusionCells& cells, bool quarter);

}  // namespace palpate::fem
