// The residual right - A x of a level, summed over blocks of two by two cells: the right side of the coarse correction.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, vec4, right_texels);
TEXELS(1, vec4, x_texels);
TEXELS(2, float, x_words);
layout(binding = 3) writeonly buffer Out { vec4 coarse[]; };

#include "shaders/frame/columns.glsl"

Ten x_row(int tx, int y) {
  int row = clamp(y, 0, int(push.height) - 1) * int(push.pitch), last = int(push.pitch) - 1, first = 8 * tx;
  Ten t;
  t.l = texelFetch(x_words, 4 * row + max(first - 1, 0)).x;
  t.a = texelFetch(x_texels, row + min(2 * tx, last));
  t.b = texelFetch(x_texels, row + min(2 * tx + 1, last));
  t.r = texelFetch(x_words, 4 * row + min(first + 8, 4 * last + 3)).x;
  return with_ghosts(t, first);
}

vec4 row_sums(Ten above, Ten here, Ten below, Columns columns, int tx, int y) {
  int row = min(y, int(push.height) - 1) * int(push.pitch), last = int(push.pitch) - 1;
  vec4 a = texelFetch(right_texels, row + min(2 * tx, last)), b = texelFetch(right_texels, row + min(2 * tx + 1, last));
  return residual_sums(a, b, above, here, below, columns, tx, y);
}

void main() {
  uint tiles_y = (push.coarse_height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.coarse_pitch * tiles_y) return;
  int tx = int(tile % push.coarse_pitch);
  int y0 = int(tile / push.coarse_pitch * push.rows);
  Columns columns = columns_at(8 * tx);
  Ten above = x_row(tx, 2 * y0 - 1), here = x_row(tx, 2 * y0);
  for (int k = y0; k < y0 + int(push.rows); ++k) {
    Ten below = x_row(tx, 2 * k + 1);
    Ten next = x_row(tx, 2 * k + 2);
    vec4 sum = row_sums(above, here, below, columns, tx, 2 * k) + row_sums(here, below, next, columns, tx, 2 * k + 1);
    if (k < int(push.coarse_height)) coarse[uint(k) * push.coarse_pitch + uint(tx)] = sum;
    above = below;
    here = next;
  }
}
