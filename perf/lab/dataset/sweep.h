// Which blocks with which lumps a data set holds: an even sweep over everything that changes a press.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/fem/scene.h"
#include "engine/lump/lump_case.h"

namespace palpate::lump {

/// Parameters of a sweep. Diameters, depths and offsets are drawn from what fits into the block that was
/// drawn before: a range is squeezed, never refilled, so that the sweep stays even.
struct Sweep {
  uint64_t seed = 1;
  Range size_mm{4, 14};            ///< diameter
  Range depth_mm{1.5, 10};         ///< surface to the top
  Range stiffness_ratio{1.3, 40};  ///< even in its logarithm
  /// Diameter and depth are even in their logarithms too, so that small and shallow lumps, whose pressure
  /// changes most from one to the next, are as many to the factor as large and deep ones; false: even.
  bool logarithmic = true;
  Range thickness_mm{16, 24};        ///< of the tissue
  Range young_Pa{2000, 30000};       ///< of the tissue, even in its logarithm
  Range greatest_press{0.10, 0.22};  ///< of the thickness, at the last load
  double offset_mm = 6;              ///< of the lump's centre from the middle, to either side in x and y
  double centred_fraction =
      0.67;  ///< of the lumps, in the middle: a quarter is solved, in a quarter of the time
  /// Of a skin, part of the thickness (see fem::Skin): even in mm, its ratio even in its logarithm. 0: none.
  Range skin_mm{0, 0}, skin_ratio{1, 1};
  /// Of the plate on every block (see fem::Scene), one of the two; neither: it slides.
  bool plate_sticks = false;
  double plate_friction = 0;
  std::array<double, 2> block_mm = {40, 40};
  double poisson = 0.495;
  double floor_mm = 1, rim_mm = 2;  ///< least tissue below the lump and beside it
  /// Another day of the same sweep: shares by which each lump's diameter, about its centre, and its stiffness
  /// ratio are more than drawn.
  double grown = 0, stiffened = 0;
  /// d is the diameter: a ball; d high and wide and 1.5 d long; d high and wide upright; 2.5 d long lying.
  std::vector<InclusionShape> shapes = {InclusionShape::Sphere, InclusionShape::Ellipsoid,
                                        InclusionShape::Cylinder, InclusionShape::LyingCylinder};
  double no_lump_fraction = 1.0 / 12;  ///< of the cases, tissue alone
  /// Each lump has a second one beside it, drawn alike, as far from it as the range of offsets allows and at
  /// least this far from surface to surface, mm; 0: one lump.
  double second_gap_mm = 0;
  uint32_t loads = 4;                            ///< equal steps of the press
  std::array<uint32_t, 3> cells = {48, 48, 24};  ///< along x, y, z whatever the thickness
  /// Cells of solve_extrapolated()'s coarser grid, of the same proportions; 0, 0, 0: one grid.
  std::array<uint32_t, 3> coarser_cells = {24, 24, 12};
  std::array<uint32_t, 2> nodes = {33, 33};  ///< of the maps along x and y, the first and the last on the rim
  double residual = 1e-5, step_mm = 2;       ///< of the solver, see LargeStrainOptions

  /// Between the maps' nodes.
  std::array<double, 2> pitch_mm() const {
    return {block_mm[0] / (nodes[0] - 1), block_mm[1] / (nodes[1] - 1)};
  }
  bool has_skin() const { return skin_mm.high > 0; }
  bool plate_slides() const { return !plate_sticks && plate_friction == 0; }
  bool two_grids() const { return coarser_cells[0] != 0; }
  /// Their cells follow each lump's surface, see solve_extrapolated(); else they are straight.
  bool follows_lumps() const;
};

/// Throws Error(Failure::Usage) naming the first field that is out of range or makes a lump that cannot fit.
void check(const Sweep& sweep);

/// Case `number` of the sweep: a pure function of both. The sweep has been checked.
Case lump_case(const Sweep& sweep, uint32_t number);

/// The case on the sweep's cells, see scene_of() of lump_case.h.
fem::Scene scene_of(const Sweep& sweep, const Case& what);

/// All of a sweep, equal for equal sweeps; and back from its line in a file. Throws Error(Failure::Input)
/// where the text is not such a line.
json::Value to_json(const Sweep& sweep);
Sweep sweep_from_json(const std::string& text);

}  // namespace palpate::lump
