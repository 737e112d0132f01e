// The way down of a cycle, as descend.comp, for GPUs: a workgroup owns a tile.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, float, right_words);
layout(binding = 1) writeonly buffer Out { float result[]; };
layout(binding = 2) writeonly buffer Coarse { float coarse[]; };

#include "shaders/surface/tile.glsl"
#define RIGHT_HALO 2
#define HEIGHTS_HALO 1
shared float right[(kTileWidth + 2 * RIGHT_HALO) * (kTileHeight + 2 * RIGHT_HALO)];
shared float heights[(kTileWidth + 2 * HEIGHTS_HALO) * (kTileHeight + 2 * HEIGHTS_HALO)];
#include "shaders/surface/tile_residual.glsl"

void main() {
  const ivec2 origin = tile_origin();
  FOR_TILE(RIGHT_HALO) right[n] = texelFetch(right_words, word_of(framed(origin + inner_of(n, RIGHT_HALO)))).x;
  barrier();
  // Two sweeps from zero: the first is push.step0 times the right side.
  FOR_TILE(HEIGHTS_HALO) {
    ivec2 inner = inner_of(n, HEIGHTS_HALO);
    int at = index_of(inner, RIGHT_HALO);
    heights[n] = push.step0 * right[at] + push.step1 * (right[at] - push.step0 * APPLY(origin + inner, right, at, RIGHT_HALO));
  }
  barrier();
  FOR_TILE(0) {
    ivec2 inner = inner_of(n, 0), cell = origin + inner;
    if (in_texels(cell)) result[word_of(cell)] = heights[index_of(framed(cell) - origin, HEIGHTS_HALO)];
  }
  put_residual_sums(origin);
}
