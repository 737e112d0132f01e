// A block as brick cells with a modulus each, and its halvings.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/fem/scene.h"

namespace palpate::fem {

/// Cells are bricks in x fastest, then y, then z; nodes are their corners in the same order. A vector field
/// has all x, then all y, then all z components: component c of node n is at c * nodes() + n.
struct CellGrid {
  std::array<uint32_t, 3> cells{};
  double size_x_mm = 0, size_y_mm = 0;  ///< of a cell
  std::vector<double> size_z_mm;        ///< of each layer of cells, from the top down
  std::vector<float> young;             ///< of each cell, in any unit; > 0
  /// Where the nodes lie at rest, 3 x nodes, from the block's middle and its surface down, if cells are no
  /// bricks (see fitted_grid.h); only the model of large strain and solve_large_strain() look. Else empty.
  std::vector<double> place_mm;
  /// A layer of cells that is not there: what lies above slides on what lies below, their nodes on either
  /// side share their movement along z. Its height and its moduli are 0; neither first nor last.
  std::optional<uint32_t> slit;

  size_t cell_count() const { return size_t{cells[0]} * cells[1] * cells[2]; }
  size_t nodes() const { return size_t{cells[0] + 1} * (cells[1] + 1) * (cells[2] + 1); }
  size_t node(uint32_t i, uint32_t j, uint32_t k) const {
    return (size_t{k} * (cells[1] + 1) + j) * (cells[0] + 1) + i;
  }
  size_t cell(uint32_t i, uint32_t j, uint32_t k) const { return (size_t{k} * cells[1] + j) * cells[0] + i; }
};

/// Nodes that the two sides of a slit share move under the sum of their forces: each side gets half of it.
/// `force` is 3 x nodes. Nothing without a slit.
template <typename Real>
void share_across_slit(const CellGrid& grid, Real* force) {
  if (!grid.slit) return;
  const size_t plane = size_t{grid.cells[0] + 1} * (grid.cells[1] + 1);
  Real *upper = force + 2 * grid.nodes() + grid.node(0, 0, *grid.slit), *lower = upper + plane;
  for (size_t n = 0; n < plane; ++n) upper[n] = lower[n] = (upper[n] + lower[n]) / 2;
}

/// Which displacements are given rather than sought, per node.
enum FixedBits : uint8_t { kFixedX = 1, kFixedY = 2, kFixedZ = 4, kFixedAll = 7 };
using FixedNodes = std::vector<uint8_t>;

/// Share of a brick (from low to high, mm, centre of the inclusion at 0) that lies in an inclusion of these
/// outer sizes: exact along z, 16 x 16 columns of the cell in x and y.
double share_inside(InclusionShape shape, const std::array<double, 3>& size_mm,
                    const std::array<double, 3>& low_mm, const std::array<double, 3>& high_mm);

/// Modulus, relative to the tissue's, of a cell of which a share lies in the inclusion: 1 + f / (1 / (ratio -
/// 1) + q (1 - f)), q = 0.8. q = 1 is the harmonic mean (springs in series), 0.4 the lower bound of Hashin
/// and Shtrikman for an incompressible body, 0 the mean. At 0.8 the centre pressure of the pad problem is 0.7
/// % low at 64 x 64 x 32 (harmonic 1.2 %), and hardly changes with the grid at ratios of 0.1 and 1000.
double mixed_modulus(double fraction, double ratio);

/// Layers of cells that a scene's skin has: a sixth of the tissue's for each sixth of the thickness, one
/// sixth at least, so that its lower face is a plane of nodes and grids of the same proportions have as large
/// a share of their layers in it. 0 without a skin.
uint32_t skin_layers(const Scene& scene);
/// Depth of the plane of nodes below so many of the tissue's layers of cells, mm: even but for a skin.
double plane_mm(const Scene& scene, uint32_t layer);

/// Tissue and inclusion of a scene, moduli relative to the tissue's. Pad sheets lie on top, a slit under them
/// where they slide. `quarter`: only x, y >= the middle.
CellGrid voxelise(const Scene& scene, bool quarter);
/// Layers of cells that each pad sheet has, outermost first, as voxelise() stacks them.
std::vector<uint32_t> pad_layers(const Scene& scene);

/// The scene is its own mirror image in x and in y, and its cells are.
bool symmetric(const Scene& scene);
/// Nodes of voxelise()'s grid that floor, plate and planes of symmetry hold; a ball holds none yet.
FixedNodes supports(const Scene& scene, const CellGrid& grid, bool quarter);

/// Half the cells along each side, with the mean modulus of those in each (harmonic means here make the cycle
/// blind to stiff inclusions); an odd number of layers above a slit stays. None where a side, or what lies
/// below a slit, is odd or shorter than four cells.
std::optional<CellGrid> halve(const CellGrid& fine);
/// Nodes of the halved grid, fixed where the fine node at the same place is.
FixedNodes halve(const CellGrid& fine, const CellGrid& coarse, const FixedNodes& fixed);

/// Which planes of nodes of a grid are those of its halving.
class HalvedPlanes {
 public:
  HalvedPlanes(const CellGrid& fine, const CellGrid& coarse);
  uint32_t fine(uint32_t coarse_plane) const;
  /// Coarse plane at a fine plane or, where that lies between two, the one above it.
  uint32_t coarse(uint32_t fine_plane) const;
  bool between(uint32_t fine_plane) const { return fine(coarse(fine_plane)) != fine_plane; }

 private:
  uint32_t fine_above_, coarse_above_, by_above_;  ///< planes above the slit, and what they are divided by
};

}  // namespace palpate::fem
