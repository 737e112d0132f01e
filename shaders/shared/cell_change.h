// Change of a frame in small cells: what the kernel leaves for each, read by GLSL and C++.
#ifndef PALPATE_SHARED_CELL_CHANGE_H
#define PALPATE_SHARED_CELL_CHANGE_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// Side of a cell, px: four cells to a texel of 8-bit pixels.
const uint kCellSide = 4;

// Sums over a cell's pixels within the frame of d = image - untouched image, for red, green and blue, gray
// levels.
struct CellChange {
  int red, green, blue;
  uint red_squares, green_squares, blue_squares;
};

struct CellChangePush {
  uint width;   // px
  uint height;  // px
  uint pitch;   // texels from one padded row to the next
  uint cells_x;
  uint cells_y;
};

#ifdef __cplusplus
static_assert(sizeof(CellChange) == 24);
}  // namespace palpate::shared
#endif
#endif
