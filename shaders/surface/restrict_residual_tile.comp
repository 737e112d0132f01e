// A level's residual summed for the coarser one, as restrict_residual.comp, for GPUs: a workgroup owns a tile.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, float, right_words);
TEXELS(1, float, x_words);
layout(binding = 2) writeonly buffer Coarse { float coarse[]; };

#include "shaders/surface/tile.glsl"
#define RIGHT_HALO 0
#define HEIGHTS_HALO 1
shared float right[(kTileWidth + 2 * RIGHT_HALO) * (kTileHeight + 2 * RIGHT_HALO)];
shared float heights[(kTileWidth + 2 * HEIGHTS_HALO) * (kTileHeight + 2 * HEIGHTS_HALO)];
#include "shaders/surface/tile_residual.glsl"

void main() {
  const ivec2 origin = tile_origin();
  FOR_TILE(RIGHT_HALO) right[n] = texelFetch(right_words, word_of(framed(origin + inner_of(n, RIGHT_HALO)))).x;
  FOR_TILE(HEIGHTS_HALO) heights[n] = texelFetch(x_words, word_of(framed(origin + inner_of(n, HEIGHTS_HALO)))).x;
  barrier();
  put_residual_sums(origin);
}
