// Pressure of the next coarser level: the load of seven by seven cells with the weights 1 6 15 20 15 6 1 of quintic B-splines, over 32.
// The load is kept: every cell's weights sum to 1. An invocation owns four coarse columns.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/elastic.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ElasticPush push; };
TEXELS(0, vec4, fine_texels);
layout(binding = 1) writeonly buffer Out { vec4 coarse[]; };

// One fine row, weighted to four coarse columns. Texels beyond a row's ends fall into the margins of its neighbours.
vec4 across(int tc, int y) {
  int at = (y + int(kElasticMargin)) * int(push.pitch) + 2 * tc - 2, last = int(push.total) - 1;
  vec4 a = texelFetch(fine_texels, clamp(at - 1, 0, last)), b = texelFetch(fine_texels, clamp(at, 0, last));
  vec4 c = texelFetch(fine_texels, clamp(at + 1, 0, last)), d = texelFetch(fine_texels, clamp(at + 2, 0, last));
  vec4 even_l = vec4(a.z, b.x, b.z, c.x), even = vec4(b.x, b.z, c.x, c.z), even_r = vec4(b.z, c.x, c.z, d.x);
  vec4 odd_ll = vec4(a.y, a.w, b.y, b.w), odd_l = vec4(a.w, b.y, b.w, c.y);
  vec4 odd_r = vec4(b.y, b.w, c.y, c.w), odd_rr = vec4(b.w, c.y, c.w, d.y);
  return (20.0 * even + 15.0 * (odd_l + odd_r) + 6.0 * (even_l + even_r) + (odd_ll + odd_rr)) / 32.0;
}

void main() {
  const int reach = int(kElasticReach), margin = int(kElasticMargin);
  uint columns = (push.width + 3) / 4 + 2, strips = (push.height + 2 * kElasticReach + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= columns * strips) return;
  int tc = int(tile % columns) + 1;
  int y0 = int(tile / columns * push.rows) - reach, end = int(push.height) + reach;
  vec4 r0 = across(tc, 2 * y0 - 3), r1 = across(tc, 2 * y0 - 2), r2 = across(tc, 2 * y0 - 1);
  vec4 r3 = across(tc, 2 * y0), r4 = across(tc, 2 * y0 + 1);
  for (int y = y0; y < y0 + int(push.rows); ++y) {
    vec4 r5 = across(tc, 2 * y + 2), r6 = across(tc, 2 * y + 3);
    vec4 sum = (20.0 * r3 + 15.0 * (r2 + r4) + 6.0 * (r1 + r5) + (r0 + r6)) / 32.0;
    if (y < end) coarse[(y + margin) * int(push.out_pitch) + tc] = sum;
    r0 = r2;
    r1 = r3;
    r2 = r4;
    r3 = r5;
    r4 = r6;
  }
}
