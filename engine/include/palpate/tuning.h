// Constants of the kernels' structure that depend on the device. No result depends on them beyond rounding,
// and the exact sums not at all.
#pragma once

#include <cstdint>

namespace palpate {

/// Two forms of the same kernels: strips, whose rows stream through an invocation's registers, and tiles,
/// which a workgroup shares; GPUs have few registers for each of their many invocations. Rows are those that
/// one invocation streams through; workgroups are invocations.
struct Tuning {
  uint32_t contact_tiles = 0;         ///< 1: contact is summed in tiles; its rows do not count then
  uint32_t contact_rows = 0;          ///< px; 0: of 32 to 64 the height that fetches the fewest rows
  uint32_t contact_rows_keeping = 0;  ///< px, where the filtered image is stored as well
  uint32_t contact_workgroup = 0;
  uint32_t slope_tiles = 0;  ///< 1: right sides are computed in tiles; what weights need is in strips of rows
  uint32_t slope_rows = 0;   ///< px
  uint32_t slope_workgroup = 0;
  uint32_t surface_rows_big = 0;    ///< cells, of levels with at least surface_big_texels
  uint32_t surface_rows_small = 0;  ///< cells, of the others
  uint32_t surface_big_texels = 0;  ///< of four cells
  uint32_t surface_workgroup = 0;
  uint32_t surface_tiles =
      0;  ///< 1: levels are solved in tiles; their rows, but for a few, do not count then
  uint32_t coarsest_cells = 0;  ///< most cells of the level that is solved directly
  uint32_t rest_level_workgroup = 0;

  bool operator==(const Tuning&) const = default;
};

}  // namespace palpate
