// The right side of the next coarser level: the sum over each block of two by two cells (the fluxes' sum, so it stays compatible).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
layout(binding = 0) uniform samplerBuffer right_texels;
layout(binding = 1) writeonly buffer Out { vec4 coarse[]; };

vec4 inside(vec4 v, int first) {
  return mix(vec4(0.0), v, lessThan(ivec4(0, 1, 2, 3) + first, ivec4(push.width)));
}

vec4 pair_sums(int tx, int y) {
  int row = min(y, int(push.height) - 1) * int(push.pitch), last = int(push.pitch) - 1;
  vec4 a = inside(texelFetch(right_texels, row + min(2 * tx, last)), 8 * tx);
  vec4 b = inside(texelFetch(right_texels, row + min(2 * tx + 1, last)), 8 * tx + 4);
  vec4 sum = vec4(a.xz + a.yw, b.xz + b.yw);
  return y < int(push.height) ? sum : vec4(0.0);
}

void main() {
  uint tiles_y = (push.coarse_height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.coarse_pitch * tiles_y) return;
  int tx = int(tile % push.coarse_pitch);
  int y0 = int(tile / push.coarse_pitch * push.rows);
  for (int k = y0; k < y0 + int(push.rows); ++k) {
    vec4 sum = pair_sums(tx, 2 * k) + pair_sums(tx, 2 * k + 1);
    if (k < int(push.coarse_height)) coarse[uint(k) * push.coarse_pitch + uint(tx)] = sum;
  }
}
