// Connected parts of one tile's contact pixels: each invocation owns a tile of the contact stage, a bit a pixel. A part grows from its
// first pixel, whole runs of a row at a time, down and up until nothing changes; parts are joined across tiles by the host. A tile
// whose contact is one part without saturated pixels needs no other sums than the contact stage's; other parts go to a list, and
// contact.comp (PARTS) sums them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/contact.h"
#include "shaders/shared/regions.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 32;
layout(constant_id = 4) const uint COLUMNS = 32;

TEXELS(0, uint, marks);
layout(binding = 1) readonly buffer Records { ContactRecord records[]; };
layout(binding = 2) writeonly buffer Heads { RegionPart heads[]; };  // of a tile whose contact is one part
layout(binding = 3) writeonly buffer Parts { RegionPart parts[]; };
layout(binding = 4) writeonly buffer PartMarks { uint part_marks[]; };  // kMaxTileRows of each part
layout(binding = 5) buffer Count { uint part_count; };
layout(push_constant) uniform Push { RegionsPush push; };

uint rest[TILE_ROWS];  // pixels that belong to no part yet
uint fill[TILE_ROWS];  // the part that grows

// Runs of ones of `mask` that hold a bit of `seeds`, from there to their upper ends: a carry runs through them.
uint upwards(uint mask, uint seeds) { return (mask & ~(mask + seeds)) | seeds; }
uint along(uint mask, uint seeds) {
  return upwards(mask, seeds) | bitfieldReverse(upwards(bitfieldReverse(mask), bitfieldReverse(seeds)));
}
// Row y of the part, with what touches it from a neighbouring row.
uint grown(uint y, uint beside) {
  uint mask = rest[y];
  return along(mask, fill[y] | ((beside | (beside << 1) | (beside >> 1)) & mask));
}

void main() {
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles) return;
  uint area = records[tile].area, saturated = records[tile].saturated;
  // A tile without contact makes no turn of any loop.
  uint rows = area > 0 ? TILE_ROWS : 0;
  for (uint y = 0; y < rows; ++y) {
    rest[y] = texelFetch(marks, int(tile * TILE_ROWS + y)).x;
    fill[y] = 0;
  }

  uint found = 0, order = 0, first = 0, alone = 0;
  while (found < area) {
    while (first + 1 < TILE_ROWS && rest[first] == 0) ++first;
    uint last = first;
    fill[first] = rest[first] & (~rest[first] + 1);
    bool changed = true;
    while (changed) {
      uint beside = 0, y = first;
      do {
        beside = grown(y, beside);
        fill[y] = beside;
        last = beside != 0 ? max(last, y) : last;
        ++y;
      } while (y < TILE_ROWS && (y <= last || beside != 0));
      // No pixel of it lies above its first one.
      changed = false;
      y = last + 1;
      beside = 0;
      do {
        --y;
        beside = grown(y, beside);
        changed = changed || beside != fill[y];
        fill[y] = beside;
      } while (y > first);
    }

    RegionPart part = RegionPart(tile, order, 0, first, last, 0, 0, 0, 0, 0, 0, 0, saturated, 0, 0, 0);
    for (uint y = first; y <= last; ++y) {
      uint f = fill[y], left = f & 1u, right = f >> (COLUMNS - 1);
      part.area += uint(bitCount(f));
      part.columns |= f;
      part.left_low |= y < 32 ? left << y : 0;
      part.left_high |= y < 32 ? 0 : left << (y & 31u);
      part.right_low |= y < 32 ? right << y : 0;
      part.right_high |= y < 32 ? 0 : right << (y & 31u);
      rest[y] &= ~f;
    }
    part.top = first == 0 ? fill[0] : 0;
    part.bottom = last == TILE_ROWS - 1 ? fill[TILE_ROWS - 1] : 0;
    part.alone = order == 0 && part.area == area && saturated == 0 ? 1 : 0;
    if (part.alone == 1) heads[tile] = part;
    alone |= part.alone;
    uint listed = part.alone == 1 ? push.capacity : atomicAdd(part_count, 1);
    if (listed < push.capacity) parts[listed] = part;
    for (uint y = first; y <= last; ++y) {
      if (listed < push.capacity) part_marks[listed * kMaxTileRows + y] = fill[y];
      fill[y] = 0;
    }
    // A full list ends the search: the sums of areas show that something is missing.
    found = listed >= push.capacity ? area : found + part.area;
    ++order;
  }
  if (area > 0 && alone == 0) heads[tile].alone = 0;
}
