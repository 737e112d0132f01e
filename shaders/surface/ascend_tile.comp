// The way up of a full-multigrid pass, as ascend.comp, for GPUs: a workgroup owns a tile. CORRECTED: from heights that still lack the
// correction of the level after theirs.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"
#include "shaders/frame/cubic.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, float, right_words);
TEXELS(1, float, coarse_words);
layout(binding = 2) writeonly buffer Out { float result[]; };
layout(binding = 3) writeonly buffer Coarse { float coarse[]; };
#ifdef CORRECTED
TEXELS(4, float, coarser_words);
#endif

#include "shaders/surface/tile.glsl"
#define HALO 3
#define RIGHT_HALO 2
#define HEIGHTS_HALO 1
#include "shaders/surface/tile_cubic.glsl"
shared float start[(kTileWidth + 2 * HALO) * (kTileHeight + 2 * HALO)];
shared float right[(kTileWidth + 2 * RIGHT_HALO) * (kTileHeight + 2 * RIGHT_HALO)];
shared float swept[(kTileWidth + 2 * RIGHT_HALO) * (kTileHeight + 2 * RIGHT_HALO)];
shared float heights[(kTileWidth + 2 * HEIGHTS_HALO) * (kTileHeight + 2 * HEIGHTS_HALO)];
#include "shaders/surface/tile_residual.glsl"

void main() {
  const ivec2 origin = tile_origin();
  FOR_TILE(RIGHT_HALO) right[n] = texelFetch(right_words, word_of(framed(origin + inner_of(n, RIGHT_HALO)))).x;
  interpolate_across(origin);
  FOR_TILE(HALO) start[n] = interpolated(origin, origin + inner_of(n, HALO));
  barrier();
  FOR_TILE(RIGHT_HALO) {
    ivec2 inner = inner_of(n, RIGHT_HALO);
    int at = index_of(inner, HALO);
    swept[n] = start[at] + push.step0 * (right[n] - APPLY(origin + inner, start, at, HALO));
  }
  barrier();
  FOR_TILE(HEIGHTS_HALO) {
    ivec2 inner = inner_of(n, HEIGHTS_HALO);
    int at = index_of(inner, RIGHT_HALO);
    heights[n] = swept[at] + push.step1 * (right[at] - APPLY(origin + inner, swept, at, RIGHT_HALO));
  }
  barrier();
  FOR_TILE(0) {
    ivec2 inner = inner_of(n, 0), cell = origin + inner;
    if (in_texels(cell)) result[word_of(cell)] = heights[index_of(framed(cell) - origin, HEIGHTS_HALO)];
  }
  put_residual_sums(origin);
}
