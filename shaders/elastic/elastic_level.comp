// A level's answer: its own stencil of nine by nine cells on its pressure, plus the coarser level's answer, interpolated by quintic
// B-splines. An invocation owns eight columns. Variant FINEST writes the frame's height map, without margins.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/elastic.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ElasticPush push; };
TEXELS(0, vec4, pressure_texels);
TEXELS(1, vec4, coarse_texels);
layout(binding = 2) writeonly buffer Out { vec4 answer[]; };

const int MARGIN = int(kElasticMargin);

// Eight columns.
struct Eight {
  vec4 a, b;
};
Eight plus(Eight u, Eight v) { return Eight(u.a + v.a, u.b + v.b); }
Eight times(float s, Eight u) { return Eight(s * u.a, s * u.b); }

// One row of pressure, with the weights of a stencil's row for each distance from it. Texels beyond a row's ends fall into the
// margins of its neighbours.
struct Filtered {
  Eight h0, h1, h2, h3, h4;
};
Eight weigh(float k0, float k1, float k2, float k3, float k4, Eight c, Eight s1, Eight s2, Eight s3, Eight s4) {
  return Eight(k0 * c.a + k1 * s1.a + k2 * s2.a + k3 * s3.a + k4 * s4.a, k0 * c.b + k1 * s1.b + k2 * s2.b + k3 * s3.b + k4 * s4.b);
}
Filtered filter_row(int u, int y) {
  int at = (y + MARGIN) * int(push.pitch) + 2 * u, last = int(push.total) - 1;
  vec4 a = texelFetch(pressure_texels, clamp(at - 1, 0, last)), b = texelFetch(pressure_texels, clamp(at, 0, last));
  vec4 c = texelFetch(pressure_texels, clamp(at + 1, 0, last)), d = texelFetch(pressure_texels, clamp(at + 2, 0, last));
  Eight s0 = Eight(b, c);
  Eight s1 = Eight(vec4(a.w, b.xyz) + vec4(b.yzw, c.x), vec4(b.w, c.xyz) + vec4(c.yzw, d.x));
  Eight s2 = Eight(vec4(a.zw, b.xy) + vec4(b.zw, c.xy), vec4(b.zw, c.xy) + vec4(c.zw, d.xy));
  Eight s3 = Eight(vec4(a.yzw, b.x) + vec4(b.w, c.xyz), vec4(b.yzw, c.x) + vec4(c.w, d.xyz));
  Eight s4 = Eight(a + c, b + d);
  // Entry (i, j), j at most i, stands at i (i + 1) / 2 + j.
  float k[kElasticOrbits] = push.stencil;
  return Filtered(weigh(k[0], k[1], k[3], k[6], k[10], s0, s1, s2, s3, s4), weigh(k[1], k[2], k[4], k[7], k[11], s0, s1, s2, s3, s4),
                  weigh(k[3], k[4], k[5], k[8], k[12], s0, s1, s2, s3, s4), weigh(k[6], k[7], k[8], k[9], k[13], s0, s1, s2, s3, s4),
                  weigh(k[10], k[11], k[12], k[13], k[14], s0, s1, s2, s3, s4));
}

// Sums of eight rows that are not complete yet, the uppermost first.
struct Open {
  Eight o0, o1, o2, o3, o4, o5, o6, o7;
};
// Takes in a row and finishes the one four rows above it.
Eight take_row(inout Open t, int u, int y) {
  Filtered f = filter_row(u, y);
  Eight done = plus(t.o0, f.h4);
  t.o0 = plus(t.o1, f.h3);
  t.o1 = plus(t.o2, f.h2);
  t.o2 = plus(t.o3, f.h1);
  t.o3 = plus(t.o4, f.h0);
  t.o4 = plus(t.o5, f.h1);
  t.o5 = plus(t.o6, f.h2);
  t.o6 = plus(t.o7, f.h3);
  t.o7 = f.h4;
  return done;
}

// A row of the coarser level, interpolated along the row to the even (a) and the odd (b) of the eight columns.
Eight coarse_row(int u, int k) {
  int at = (k + MARGIN) * int(push.coarse_pitch) + u, last = int(push.coarse_total) - 1;
  vec4 l = texelFetch(coarse_texels, clamp(at, 0, last)), c = texelFetch(coarse_texels, clamp(at + 1, 0, last));
  vec4 r = texelFetch(coarse_texels, clamp(at + 2, 0, last));
  vec4 before = vec4(l.w, c.xyz), after = vec4(c.yzw, r.x), second = vec4(c.zw, r.xy);
  return Eight((6.0 * (before + after) + 20.0 * c) / 32.0, (before + 15.0 * (c + after) + second) / 32.0);
}

void store(Eight own, Eight coarse, int u, int y, int end) {
  vec4 a = own.a + vec4(coarse.a.x, coarse.b.x, coarse.a.y, coarse.b.y);
  vec4 b = own.b + vec4(coarse.a.z, coarse.b.z, coarse.a.w, coarse.b.w);
#ifdef FINEST
  int column = 2 * u - MARGIN / 4, at = y * int(push.out_pitch) + column;
  if (y < end) {
    answer[at] = a;
    if (column + 1 < int(push.out_pitch)) answer[at + 1] = b;
  }
#else
  int at = (y + MARGIN) * int(push.out_pitch) + 2 * u;
  if (y < end) {
    answer[at] = a;
    answer[at + 1] = b;
  }
#endif
}

void main() {
  int texels = (int(push.width) + 3) / 4;
#ifdef FINEST
  const int first = 0;
  int columns = (texels + 1) / 2, u0 = 1, end = int(push.height);
#else
  const int first = -int(kElasticReach);
  int columns = (texels + 2) / 2 + 1, u0 = 0, end = int(push.height) + int(kElasticReach);
#endif
  int strips = (end - first + int(push.rows) - 1) / int(push.rows);
  int tile = int(gl_GlobalInvocationID.x);
  if (tile >= columns * strips) return;
  int u = tile % columns + u0, y0 = tile / columns * int(push.rows) + first;
  const Eight none = Eight(vec4(0.0), vec4(0.0));
  Open open = Open(none, none, none, none, none, none, none, none);
  for (int i = 0; i < 8; ++i) take_row(open, u, y0 - 4 + i);
  int k = y0 / 2;
  Eight before = coarse_row(u, k - 1), here = coarse_row(u, k), after = coarse_row(u, k + 1);
  for (int y = y0; y < y0 + int(push.rows); y += 2, ++k) {
    Eight upper = take_row(open, u, y + 4), lower = take_row(open, u, y + 5);
    Eight second = coarse_row(u, k + 2);
    store(upper, times(1.0 / 32.0, plus(times(6.0, plus(before, after)), times(20.0, here))), u, y, end);
    store(lower, times(1.0 / 32.0, plus(plus(before, second), times(15.0, plus(here, after)))), u, y + 1, end);
    before = here;
    here = after;
    after = second;
  }
}
