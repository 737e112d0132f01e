// Goes alpha along the direction: heights and residual, and the sum of the residual's squares. START: heights of zero, and the
// squares of the right side as it stands.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { WeightedPush push; };
TEXELS(0, vec4, residual_texels);
#ifdef START
layout(binding = 1) writeonly buffer Heights { vec4 heights[]; };
layout(binding = 2) writeonly buffer Squares { float squares[]; };
#else
TEXELS(1, vec4, heights_texels);
TEXELS(2, vec4, direction_texels);
TEXELS(3, vec4, applied_texels);
layout(binding = 4) readonly buffer Scalars { WeightedScalars scalars; };
layout(binding = 5) writeonly buffer Heights { vec4 heights[]; };
layout(binding = 6) writeonly buffer Residual { vec4 residual[]; };
layout(binding = 7) writeonly buffer Squares { float squares[]; };
#endif

void main() {
  uint tiles_x = (push.pitch + 1) / 2, tiles = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles) return;
  int tx = int(tile % tiles_x), y0 = int(tile / tiles_x * TILE_ROWS), height = int(push.height), last = int(push.pitch) - 1;
  bool wide = 2 * tx + 1 <= last;
  vec4 square = vec4(0.0);
#ifndef START
  float alpha = scalars.alpha;
#endif
  for (int y = y0; y < y0 + int(TILE_ROWS); ++y) {
    int row = min(y, height - 1) * int(push.pitch), a = row + 2 * tx, b = row + min(2 * tx + 1, last);
    vec4 ra = texelFetch(residual_texels, a), rb = texelFetch(residual_texels, b);
#ifdef START
    vec4 za = vec4(0.0), zb = za;
#else
    vec4 za = texelFetch(heights_texels, a) + alpha * texelFetch(direction_texels, a);
    vec4 zb = texelFetch(heights_texels, b) + alpha * texelFetch(direction_texels, b);
    ra -= alpha * texelFetch(applied_texels, a);
    rb -= alpha * texelFetch(applied_texels, b);
#endif
    if (y < height) {
      heights[a] = za;
      if (wide) heights[b] = zb;
#ifndef START
      residual[a] = ra;
      if (wide) residual[b] = rb;
#endif
    }
    square += y < height ? ra * ra + (wide ? rb * rb : vec4(0.0)) : vec4(0.0);
  }
  squares[tile] = square.x + square.y + square.z + square.w;
}
