// The form of the level's kernels for GPUs: a workgroup owns a tile of kTileWidth x kTileHeight cells and what its stages need around
// them, in shared memory; an invocation computes single cells. Where the strips of a processor keep rows in registers, a GPU has none
// to spare. Included after `push` (GridPush) is declared; needs grid.glsl.
#include "shaders/shared/tile.h"

// Place of the tile's first cell.
ivec2 tile_origin() { return ivec2(gl_WorkGroupID.xy) * ivec2(kTileWidth, kTileHeight); }

bool in_frame(ivec2 cell) { return all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, ivec2(push.width, push.height))); }

#include "shaders/surface/for_shared.glsl"
// That over the cells of the tile with `halo` cells around it, in the order of its arrays; n is a cell's index.
#define FOR_TILE(halo) FOR_SHARED(n, (kTileWidth + 2 * (halo)) * (kTileHeight + 2 * (halo)))
// The place of such a cell in the tile, and its index in an array with another halo.
ivec2 inner_of(int n, int halo) { return ivec2(n % (kTileWidth + 2 * halo), n / (kTileWidth + 2 * halo)) - halo; }
int index_of(ivec2 inner, int halo) { return (inner.y + halo) * (kTileWidth + 2 * halo) + inner.x + halo; }

// The operator of grid.glsl on one cell c with its neighbours; those beyond the frame are not read.
float apply(ivec2 cell, float c, float l, float r, float u, float d) {
  ivec2 last = ivec2(push.width, push.height) - 1;
  vec2 nearer = 2.0 / (1.0 + vec2(push.edge_width, push.edge_height));
  float left = choose(cell.x == last.x, nearer.x, 1.0), right = choose(cell.x == last.x - 1, nearer.x, 1.0);
  float wide = choose(cell.x == last.x, push.edge_width, 1.0);
  vec3 row = row_couplings(push, cell.y);
  l = choose(cell.x == 0, c, l);
  r = choose(cell.x == last.x, c, r);
  u = choose(cell.y == 0, c, u);
  d = choose(cell.y == last.y, c, d);
  return row.z * push.across * (left * (c - l) + right * (c - r)) + push.down * wide * (row.x * (c - u) + row.y * (c - d));
}
// The same from an array of the tile with `halo` cells around it; `at` is the cell's index there.
#define APPLY(cell, values, at, halo)                                                                  \
  apply(cell, values[at], values[(at) - 1], values[(at) + 1], values[(at) - (kTileWidth + 2 * (halo))], \
        values[(at) + (kTileWidth + 2 * (halo))])

// A cell's word in maps of the level. Texels are whole: their last columns repeat the frame's last one.
bool in_texels(ivec2 cell) { return cell.x < 4 * int(push.pitch) && cell.y < int(push.height); }
int word_of(ivec2 cell) { return cell.y * 4 * int(push.pitch) + cell.x; }
// The nearest one inside the frame.
ivec2 framed(ivec2 cell) { return clamp(cell, ivec2(0), ivec2(push.width, push.height) - 1); }
