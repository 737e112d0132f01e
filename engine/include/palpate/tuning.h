// Constants of the kernels' structure that depend on the device. No result depends on them beyond rounding,
// and the exact sums not at all.
#pragma once

#include <cstdint>

namespace palpate {

/// Rows are those that one invocation streams through; workgroups are invocations.
struct Tuning {
  uint32_t contact_rows = 0;          ///< px; 0: of 32 to 64 the height that fetches the fewest rows
  uint32_t contact_rows_keeping = 0;  ///< px, where the filtered image is stored as well
  uint32_t contact_workgroup = 0;
  uint32_t slope_rows = 0;  ///< px
  uint32_t slope_workgroup = 0;
  uint32_t surface_rows_big = 0;    ///< cells, of levels with at least surface_big_texels
  uint32_t surface_rows_small = 0;  ///< cells, of the others
  uint32_t surface_big_texels = 0;  ///< of four cells
  uint32_t surface_workgroup = 0;
  uint32_t coarsest_cells = 0;  ///< most cells of the level that is solved directly
  uint32_t rest_level_workgroup = 0;

  bool operator==(const Tuning&) const = default;
};

}  // namespace palpate
