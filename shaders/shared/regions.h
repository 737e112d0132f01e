// Regions stage: what the kernel leaves for each connected part of a tile's contact, read by GLSL and C++.
#ifndef PALPATE_SHARED_REGIONS_H
#define PALPATE_SHARED_REGIONS_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// One connected part (8 neighbours) of the contact pixels of one tile of the contact stage. Rows count from
// the tile's top, columns from its left; a bit a pixel, the first row or column the lowest bit.
struct RegionPart {
  uint tile;
  uint order;  // among the tile's parts, by their first pixels in reading order
  uint area;
  uint first_row;
  uint last_row;
  uint columns;    // that have pixels of it
  uint top;        // its pixels in the tile's first row
  uint bottom;     // in the last of the tile's rows
  uint left_low;   // in the first column: rows 0 to 31
  uint left_high;  // rows 32 to 63
  uint right_low;  // in the tile's last column
  uint right_high;
  uint saturated;  // of the whole tile: not 0 where the part has to count its own
  uint alone;      // 1: the tile's contact is this part alone, and its sums are the tile's
  uint unused0;
  uint unused1;
};

struct RegionsPush {
  uint tiles;
  uint capacity;  // parts that the list has room for
};

#ifdef __cplusplus
static_assert(sizeof(RegionPart) == 64);
}  // namespace palpate::shared
#endif
#endif
