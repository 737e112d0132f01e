// Heights of the coarser level in shared memory, for interpolation by cubics: those under the tile and HALO fine cells around it, with
// two more cells each way, going on linearly beyond the frame. Included after `coarse_words` is declared; needs tile.glsl and
// cubic.glsl. CORRECTED: plus the correction of the level after it, `coarser_words`.
const int kCoarseMargin = (HALO + 1) / 2 + 2;
const int kCoarseWidth = kTileWidth / 2 + 2 * kCoarseMargin, kCoarseHeight = kTileHeight / 2 + 2 * kCoarseMargin;
const int kAcross = kTileWidth + 2 * HALO;
shared float coarse_cells[kCoarseWidth * kCoarseHeight];
shared float across_rows[kAcross * kCoarseHeight];

#ifdef CORRECTED
#define CORRECTION_WORDS coarser_words
#include "shaders/surface/tile_linear.glsl"

float halved_edge(uint cells, float edge) { return cells == 1 ? edge : (cells & 1) == 0 ? 0.5 + 0.5 * edge : 0.5 * edge; }
#endif

float coarse_at(ivec2 cell) {
  float height = texelFetch(coarse_words, cell.y * 4 * int(push.coarse_pitch) + cell.x).x;
#ifdef CORRECTED
  vec2 edge = vec2(halved_edge(push.width, push.edge_width), halved_edge(push.height, push.edge_height));
  height += linear_correction(cell, ivec2(push.coarse_width, push.coarse_height), edge);
#endif
  return height;
}

// Cells beyond an edge are this far from the edge's cell, in cells, and go on by the difference of the two last.
float coarse_height(ivec2 cell) {
  ivec2 last = ivec2(push.coarse_width, push.coarse_height) - 1, at = clamp(cell, ivec2(0), last), beyond = cell - at;
  float here = coarse_at(at);
  if (beyond == ivec2(0)) return here;
  ivec2 before = clamp(at - sign(beyond), ivec2(0), last);
  float beside = coarse_at(ivec2(before.x, at.y)), under = coarse_at(ivec2(at.x, before.y)), both = coarse_at(before);
  float row = here + abs(float(beyond.x)) * (here - beside), row_before = under + abs(float(beyond.x)) * (under - both);
  return row + abs(float(beyond.y)) * (row - row_before);
}

// Rows of the coarser level at the tile's columns. Ends with a barrier.
void interpolate_across(ivec2 origin) {
  const ivec2 first = origin / 2 - kCoarseMargin;
  FOR_SHARED(n, kCoarseWidth * kCoarseHeight)
    coarse_cells[n] = coarse_height(first + ivec2(n % kCoarseWidth, n / kCoarseWidth));
  barrier();
  FOR_SHARED(n, kAcross * kCoarseHeight) {
    int x = origin.x - HALO + n % kAcross, away = (x & 1) == 1 ? 1 : -1;
    int at = n / kAcross * kCoarseWidth + (x >> 1) - first.x;
    vec4 w = cubic(x, int(push.width), push.edge_width);
    across_rows[n] = w.x * coarse_cells[at + 2 * away] + w.y * coarse_cells[at + away] + w.z * coarse_cells[at] +
                     w.w * coarse_cells[at - away];
  }
  barrier();
}

// At a cell of the tile or of the HALO around it.
float interpolated(ivec2 origin, ivec2 cell) {
  int away = (cell.y & 1) == 1 ? kAcross : -kAcross;
  int at = ((cell.y >> 1) - (origin.y / 2 - kCoarseMargin)) * kAcross + cell.x - origin.x + HALO;
  vec4 w = cubic(cell.y, int(push.height), push.edge_height);
  return w.x * across_rows[at + 2 * away] + w.y * across_rows[at + away] + w.z * across_rows[at] + w.w * across_rows[at - away];
}
