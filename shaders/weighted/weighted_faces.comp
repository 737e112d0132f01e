// Slopes and weights at pixel centres to faces between neighbours: the integral of the slope across each, its weight (the smaller
// of the two pixels'), and the right side of the weighted normal equations. A slope of weight 0 is never looked at, be it NaN.
// An invocation owns four columns and TILE_ROWS rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { WeightedPush push; };
TEXELS(0, vec4, p_texels);
TEXELS(1, vec4, q_texels);
TEXELS(2, vec4, weight_texels);
layout(binding = 3) writeonly buffer Across { vec4 wx[]; };
layout(binding = 4) writeonly buffer Down { vec4 wy[]; };
layout(binding = 5) writeonly buffer Right { vec4 right_side[]; };
layout(binding = 6) writeonly buffer Field { float field[]; };

// Columns -2 .. 5 around a texel.
struct Eight {
  vec4 a, b;
};

Eight eight(vec4 l, vec4 c, vec4 r) { return Eight(vec4(l.zw, c.xy), vec4(c.zw, r.xy)); }
#define eight_at(texels, tx, row)                                                       \
  eight(texelFetch(texels, (row) + max((tx) - 1, 0)), texelFetch(texels, (row) + (tx)), \
        texelFetch(texels, (row) + min((tx) + 1, int(push.pitch) - 1)))

vec4 known(vec4 slope, vec4 weight) { return mix(vec4(0.0), slope, greaterThan(weight, vec4(0.0))); }

// The integral from b to c of the cubic through a, b, c, d. An outer sample counts as far as it is known as well as the pair; what
// is missing goes on linearly, which is exact for parabolas.
vec4 between(vec4 a, vec4 b, vec4 c, vec4 d, vec4 wa, vec4 wd, vec4 w) {
  vec4 full = max(w, vec4(1e-30));
  a = mix(2.0 * b - c, a, min(wa / full, vec4(1.0)));
  d = mix(2.0 * c - b, d, min(wd / full, vec4(1.0)));
  return push.scale * (13.0 * (b + c) - a - d) / 24.0;
}
float between(float a, float b, float c, float d, float wa, float wd, float w) {
  float full = max(w, 1e-30);
  a = mix(2.0 * b - c, a, min(wa / full, 1.0));
  d = mix(2.0 * c - b, d, min(wd / full, 1.0));
  return push.scale * (13.0 * (b + c) - a - d) / 24.0;
}

// Faces inside the frame that say nothing keep a small negative weight.
vec4 stored(vec4 w, bvec4 inside) {
  return mix(vec4(0.0), mix(vec4(-kUnknownFace), w, greaterThan(w, vec4(0.0))), inside);
}

struct Row {
  vec4 q, w;        // at columns 0 .. 3
  vec4 across;      // what column faces give the right side
  vec4 wx, energy;  // of the right faces
};

Row row_at(int tx, int y) {
  int height = int(push.height), width = int(push.width), first = 4 * tx;
  int row = clamp(y, 0, height - 1) * int(push.pitch);
  bool here = y >= 0 && y < height;
  Eight p = eight_at(p_texels, tx, row), w = eight_at(weight_texels, tx, row);
  ivec4 columns = ivec4(-2, -1, 0, 1) + first;
  bvec4 inside_a = greaterThanEqual(columns, ivec4(0)), inside_b = lessThan(columns + 4, ivec4(width));
  inside_a = bvec4(inside_a.x && here, inside_a.y && here, columns.z < width && here, columns.w < width && here);
  inside_b = bvec4(inside_b.x && here, inside_b.y && here, inside_b.z && here, inside_b.w && here);
  w.a = mix(vec4(0.0), w.a, inside_a);
  w.b = mix(vec4(0.0), w.b, inside_b);
  p.a = known(p.a, w.a);
  p.b = known(p.b, w.b);
  Row r;
  r.w = vec4(w.a.zw, w.b.xy);
  r.q = known(texelFetch(q_texels, row + tx), r.w);
  // Left faces of columns 0 .. 3 lie between columns (-1, 0) .. (2, 3), the last right face between (3, 4).
  vec4 wl = min(vec4(w.a.yzw, w.b.x), r.w);
  vec4 gl = between(p.a, vec4(p.a.yzw, p.b.x), vec4(p.a.zw, p.b.xy), vec4(p.a.w, p.b.xyz), w.a, vec4(w.a.w, w.b.xyz), wl);
  float last = min(w.b.y, w.b.z);
  vec4 wr = vec4(wl.yzw, last);
  vec4 gr = vec4(gl.yzw, between(p.b.x, p.b.y, p.b.z, p.b.w, w.b.x, w.b.w, last));
  r.across = wl * gl - wr * gr;
  r.energy = wr * gr * gr;
  r.wx = stored(wr, bvec4(inside_a.w, inside_b.x, inside_b.y, inside_b.z));
  return r;
}

void main() {
  uint tiles = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.pitch * tiles) return;
  int tx = int(tile % push.pitch), y0 = int(tile / push.pitch * TILE_ROWS), height = int(push.height);
  Row r0 = row_at(tx, y0 - 2), r1 = row_at(tx, y0 - 1), r2 = row_at(tx, y0), r3 = row_at(tx, y0 + 1);
  vec4 w_above = min(r1.w, r2.w);
  vec4 g_above = between(r0.q, r1.q, r2.q, r3.q, r0.w, r3.w, w_above);
  vec4 energy = vec4(0.0);
  for (int y = y0; y < y0 + int(TILE_ROWS); ++y) {
    Row r4 = row_at(tx, y + 2);
    vec4 w_below = min(r2.w, r3.w);
    vec4 g_below = between(r1.q, r2.q, r3.q, r4.q, r1.w, r4.w, w_below);
    if (y < height) {
      uint at = uint(y) * push.pitch + uint(tx);
      bvec4 inside = lessThan(ivec4(0, 1, 2, 3) + 4 * tx, ivec4(y + 1 < height ? int(push.width) : 0));
      wx[at] = r2.wx;
      wy[at] = stored(w_below, inside);
      right_side[at] = r2.across + w_above * g_above - w_below * g_below;
    }
    energy += r2.energy + w_below * g_below * g_below;
    w_above = w_below;
    g_above = g_below;
    r1 = r2;
    r2 = r3;
    r3 = r4;
  }
  field[tile] = energy.x + energy.y + energy.z + energy.w;
}
