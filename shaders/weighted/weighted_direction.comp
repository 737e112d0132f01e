// The next direction of conjugate gradients, preconditioned residual + beta times the last direction; A times it; and the sums of
// their products.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"
#define KNOWN_ONLY

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { WeightedPush push; };
TEXELS(0, vec4, wx_texels);
TEXELS(1, float, wx_words);
TEXELS(2, vec4, wy_texels);
TEXELS(3, vec4, y_texels);
TEXELS(4, float, y_words);
TEXELS(5, vec4, last_texels);
TEXELS(6, float, last_words);
layout(binding = 7) readonly buffer Scalars { WeightedScalars scalars; };
layout(binding = 8) writeonly buffer Next { vec4 next[]; };
layout(binding = 9) writeonly buffer Applied { vec4 applied[]; };
layout(binding = 10) writeonly buffer Dots { float dots[]; };

#include "shaders/weighted/weighted_rows.glsl"

// Without a last direction its memory may hold anything.
Ten direction_at(float beta, int tx, int y) {
  Ten t = ten_at(y_texels, y_words, tx, y), before = ten_at(last_texels, last_words, tx, y);
  bool on = beta != 0.0;
  t.l += on ? beta * before.l : 0.0;
  t.a += on ? beta * before.a : vec4(0.0);
  t.b += on ? beta * before.b : vec4(0.0);
  t.r += on ? beta * before.r : 0.0;
  return t;
}

void main() {
  uint tiles_x = (push.pitch + 1) / 2, tiles = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles) return;
  int tx = int(tile % tiles_x), y0 = int(tile / tiles_x * TILE_ROWS), height = int(push.height);
  bool wide = 2 * tx + 1 < int(push.pitch);
  float beta = scalars.beta;
  Faces above = faces_at(tx, y0 - 1);
  Ten up = direction_at(beta, tx, y0 - 1), c = direction_at(beta, tx, y0);
  vec4 dot = vec4(0.0);
  for (int y = y0; y < y0 + int(TILE_ROWS); ++y) {
    Faces here = faces_at(tx, y);
    Ten down = direction_at(beta, tx, y + 1);
    Pair ax = apply(above, here, up, c, down);
    if (y < height) {
      uint at = uint(y) * push.pitch + 2 * uint(tx);
      next[at] = c.a;
      applied[at] = ax.a;
      if (wide) {
        next[at + 1] = c.b;
        applied[at + 1] = ax.b;
      }
    }
    dot += y < height ? c.a * ax.a + (wide ? c.b * ax.b : vec4(0.0)) : vec4(0.0);
    above = here;
    up = c;
    c = down;
  }
  dots[tile] = sum(dot);
}
