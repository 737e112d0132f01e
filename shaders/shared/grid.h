// Surface stage: the grids of the multigrid solver, read by GLSL and C++.
#ifndef PALPATE_SHARED_GRID_H
#define PALPATE_SHARED_GRID_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// One level and the next coarser one. Cells are stored in rows of `pitch` texels of four floats.
struct GridPush {
  uint width;  // cells
  uint height;
  uint pitch;         // texels
  uint coarse_width;  // cells
  uint coarse_height;
  uint coarse_pitch;  // texels
  uint rows;          // rows that one invocation streams through (of the level it writes), even
  float across;       // coupling of neighbours in a row
  float down;         // coupling of neighbours in a column
  float edge_width;   // of the last column's cells, in cells: less than 1 where an odd level was halved
  float edge_height;  // of the last row's cells
  float step0;        // the two Chebyshev-Jacobi steps, divided by the diagonal
  float step1;
};

// One of the levels that a single workgroup keeps; as in GridPush.
struct CoarseLevel {
  uint width, height;
  float across, down;
  float edge_width, edge_height;
};
const uint kCoarseLevels = 4;
struct CoarsePush {
  CoarseLevel levels[kCoarseLevels];  // finest first
  uint count;                         // of them
  uint pitch;                         // texels of the finest one
  uint cycled;                        // a bit a level: a full-multigrid pass has a cycle there
  float root0;                        // the two Chebyshev-Jacobi steps times the diagonal are 1 over these
  float root1;
};

struct CoarsestPush {
  uint texels;  // of the level
};

// Cells at the edge of what is known.
struct EdgePush {
  uint cells;
  uint groups;  // of four cells
  uint row;     // words from one row of a map to the next
  uint words;   // of a map
  uint first;   // 1: the right side holds no sources yet
};

struct RestLevelPush {
  uint width;    // px
  uint height;   // px
  uint pitch;    // texels of the height map
  uint tiles_x;  // tiles as in the contact stage
  uint tiles_y;
  uint tile_texels;  // width of a tile, texels of four px
  uint tile_rows;
};

// Heights of one tile at rest.
struct RestLevelRecord {
  float mean;     // mm, over the tile's pixels that were read
  float highest;  // mm
  uint pixels;    // of the tile inside the frame
};

#ifdef __cplusplus
static_assert(sizeof(CoarsePush) == 116);
}  // namespace palpate::shared
#endif
#endif
