// The residual right - A x of a level, summed over blocks of two by two cells: the right side of the coarse correction.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
layout(binding = 0) uniform samplerBuffer right_texels;
layout(binding = 1) uniform samplerBuffer x_texels;
layout(binding = 2) uniform samplerBuffer x_words;
layout(binding = 3) writeonly buffer Out { vec4 coarse[]; };

// Columns -1 .. 8 around two texels.
struct Ten {
  float l, r;
  vec4 a, b;
};

Ten x_row(int tx, int y) {
  int row = clamp(y, 0, int(push.height) - 1) * int(push.pitch), last = int(push.pitch) - 1;
  int width = int(push.width), first = 8 * tx;
  Ten t;
  t.l = texelFetch(x_words, 4 * row + max(first - 1, 0)).x;
  t.a = texelFetch(x_texels, row + min(2 * tx, last));
  t.b = texelFetch(x_texels, row + min(2 * tx + 1, last));
  t.r = texelFetch(x_words, 4 * row + min(first + 8, 4 * last + 3)).x;
  t.l = first == 0 ? t.a.x : t.l;
  t.a.y = first + 1 < width ? t.a.y : t.a.x;
  t.a.z = first + 2 < width ? t.a.z : t.a.y;
  t.a.w = first + 3 < width ? t.a.w : t.a.z;
  t.b.x = first + 4 < width ? t.b.x : t.a.w;
  t.b.y = first + 5 < width ? t.b.y : t.b.x;
  t.b.z = first + 6 < width ? t.b.z : t.b.y;
  t.b.w = first + 7 < width ? t.b.w : t.b.z;
  t.r = first + 8 < width ? t.r : t.b.w;
  return t;
}

vec4 residual(vec4 f, vec4 c, vec4 l, vec4 r, vec4 u, vec4 d, int first, vec3 row) {
  vec4 rest = f - apply(couplings(push, first), row, c, l, r, u, d);
  return mix(vec4(0.0), rest, lessThan(ivec4(0, 1, 2, 3) + first, ivec4(push.width)));
}

// Row y's residual, summed in pairs along the row. Rows beyond the last have none.
vec4 pair_sums(Ten above, Ten here, Ten below, int tx, int y) {
  int row = min(y, int(push.height) - 1) * int(push.pitch), last = int(push.pitch) - 1;
  vec4 fa = texelFetch(right_texels, row + min(2 * tx, last)), fb = texelFetch(right_texels, row + min(2 * tx + 1, last));
  vec3 couple = row_couplings(push, y);
  vec4 a = residual(fa, here.a, vec4(here.l, here.a.xyz), vec4(here.a.yzw, here.b.x), above.a, below.a, 8 * tx, couple);
  vec4 b = residual(fb, here.b, vec4(here.a.w, here.b.xyz), vec4(here.b.yzw, here.r), above.b, below.b, 8 * tx + 4, couple);
  return y < int(push.height) ? vec4(a.xz + a.yw, b.xz + b.yw) : vec4(0.0);
}

void main() {
  uint tiles_y = (push.coarse_height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.coarse_pitch * tiles_y) return;
  int tx = int(tile % push.coarse_pitch);
  int y0 = int(tile / push.coarse_pitch * push.rows);
  // Clamped rows are the ghosts above the first and below the last row.
  Ten above = x_row(tx, 2 * y0 - 1), here = x_row(tx, 2 * y0);
  for (int k = y0; k < y0 + int(push.rows); ++k) {
    Ten below = x_row(tx, 2 * k + 1);
    Ten next = x_row(tx, 2 * k + 2);
    vec4 sum = pair_sums(above, here, below, tx, 2 * k) + pair_sums(here, below, next, tx, 2 * k + 1);
    if (k < int(push.coarse_height)) coarse[uint(k) * push.coarse_pitch + uint(tx)] = sum;
    above = below;
    here = next;
  }
}
