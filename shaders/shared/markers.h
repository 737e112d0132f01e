// Markers stage: printed dots found in a frame, and what the frame would show without them; read by GLSL and
// C++.
#ifndef PALPATE_SHARED_MARKERS_H
#define PALPATE_SHARED_MARKERS_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// Markers are found, and the change of colour is continued, in cells of 2 x 2 px, small ones in cells of one.
// A cell holds four times its mean, red, green and blue, kCellBits each.
const uint kCellBits = 10;
const uint kCellMask = 1023;
const uint kCellMost = 1020;
// Side of the blocks that light is estimated in, px.
const uint kMarkerBlock = 8;
// Added to the light before a darkness is a share of it, in a cell's units: 10 gray levels.
const uint kMarkerBlack = 40;
// A threshold of 256 is complete darkness. Each colour by itself has to be a quarter as dark.
const uint kMarkerDark = 256;
const uint kMarkerDarkEach = 1024;
// Cells around what is dark that count as marker too.
const uint kMarkerRim = 1;
// A record counts a word's marked cells, and above that bit those of them that nothing is known of.
const uint kMarkerCountBits = 8;
// Weight of what lies n cells away: this over n.
const uint kMarkerNear = 65536;

struct MarkersPush {
  uint width;   // px
  uint height;  // px
  uint pitch;   // texels from one padded row to the next
  uint cell;    // px, the side of a cell: 1 or 2
  uint cells_x;
  uint cells_y;
  uint words;  // of 32 cells, in a row of the masks
  uint blocks_x;
  uint blocks_y;
  uint closing;    // blocks, on each side, over which light is compared
  uint threshold;  // darkness from which a cell belongs to a marker
  uint reach;      // cells, along row and column, up to where known ones are looked for
};

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif
