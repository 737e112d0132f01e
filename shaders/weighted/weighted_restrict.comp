// The residual right - A x of a level of the preconditioner, summed over blocks of two by two cells. An invocation owns four
// coarse cells in each of TILE_ROWS coarse rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 8;
layout(push_constant) uniform Push { WeightedPush push; };
TEXELS(0, vec4, wx_texels);
TEXELS(1, float, wx_words);
TEXELS(2, vec4, wy_texels);
TEXELS(3, vec4, right_texels);
TEXELS(4, vec4, x_texels);
TEXELS(5, float, x_words);
layout(binding = 6) writeonly buffer Out { vec4 coarse[]; };

#include "shaders/weighted/weighted_rows.glsl"

// Row y's residual, summed in pairs along the row; nothing beyond the last row.
vec4 pair_sums(Faces above, Faces here, Ten up, Ten c, Ten down, int tx, int y) {
  Pair right = pair_at(right_texels, tx, y), ax = apply(above, here, up, c, down);
  vec4 a = right.a - ax.a, b = right.b - ax.b;
  b = 2 * tx + 1 < int(push.pitch) ? b : vec4(0.0);
  return y < int(push.height) ? vec4(a.xz + a.yw, b.xz + b.yw) : vec4(0.0);
}

void main() {
  uint tiles = (push.coarse_height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.coarse_pitch * tiles) return;
  int tx = int(tile % push.coarse_pitch), y0 = int(tile / push.coarse_pitch * TILE_ROWS);
  Faces above = faces_at(tx, 2 * y0 - 1);
  Ten up = ten_at(x_texels, x_words, tx, 2 * y0 - 1), c = ten_at(x_texels, x_words, tx, 2 * y0);
  for (int k = y0; k < y0 + int(TILE_ROWS); ++k) {
    Faces upper = faces_at(tx, 2 * k), lower = faces_at(tx, 2 * k + 1);
    Ten down = ten_at(x_texels, x_words, tx, 2 * k + 1), next = ten_at(x_texels, x_words, tx, 2 * k + 2);
    vec4 sums = pair_sums(above, upper, up, c, down, tx, 2 * k) + pair_sums(upper, lower, c, down, next, tx, 2 * k + 1);
    if (k < int(push.coarse_height)) coarse[uint(k) * push.coarse_pitch + uint(tx)] = sums;
    above = lower;
    up = down;
    c = next;
  }
}
