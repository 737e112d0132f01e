// The end of a cycle, as smooth.comp, for GPUs: a workgroup owns a tile. With ONLY_CORRECT as correct.comp: no sweeps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, float, coarse_words);
TEXELS(1, float, present_words);
layout(binding = 2) writeonly buffer Out { float result[]; };
#ifndef ONLY_CORRECT
TEXELS(3, float, right_words);
#endif

#include "shaders/surface/tile.glsl"
#define CORRECTION_WORDS coarse_words
#include "shaders/surface/tile_linear.glsl"

float corrected(ivec2 cell) {
  cell = framed(cell);
  return texelFetch(present_words, word_of(cell)).x +
         linear_correction(cell, ivec2(push.width, push.height), vec2(push.edge_width, push.edge_height));
}

#ifdef ONLY_CORRECT
void main() {
  const ivec2 origin = tile_origin();
  FOR_TILE(0) {
    ivec2 cell = origin + inner_of(n, 0);
    if (in_texels(cell)) result[word_of(cell)] = corrected(cell);
  }
}
#else
shared float start[(kTileWidth + 2 * 2) * (kTileHeight + 2 * 2)];
shared float swept[(kTileWidth + 2 * 1) * (kTileHeight + 2 * 1)];

float right_of(ivec2 cell) { return texelFetch(right_words, word_of(framed(cell))).x; }

void main() {
  const ivec2 origin = tile_origin();
  FOR_TILE(2) start[n] = corrected(origin + inner_of(n, 2));
  barrier();
  FOR_TILE(1) {
    ivec2 inner = inner_of(n, 1), cell = origin + inner;
    int at = index_of(inner, 2);
    swept[n] = start[at] + push.step0 * (right_of(cell) - APPLY(cell, start, at, 2));
  }
  barrier();
  FOR_TILE(0) {
    ivec2 place = origin + inner_of(n, 0), cell = framed(place);
    int at = index_of(cell - origin, 1);
    float twice = swept[at] + push.step1 * (right_of(cell) - APPLY(cell, swept, at, 1));
    if (in_texels(place)) result[word_of(place)] = twice;
  }
}
#endif
