// Pixels to the right side of the least-squares surface problem: slopes p = d(depth)/dx, q = d(depth)/dy at pixel centres, their
// integrals across each pair of neighbours (fourth order), and the divergence of those; and its sums over two by two pixels, the
// right side of the next coarser level. Slopes are never stored.
// An invocation owns four columns and TILE_ROWS rows. Variants: READING_GIVEN (slopes from a buffer), READING_SHADING,
// READING_PHOTOMETRIC.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/slope.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 32;
layout(push_constant) uniform Push { SlopePush push; };

#if defined(READING_GIVEN)
layout(binding = 0) uniform samplerBuffer p_texels;
layout(binding = 1) uniform samplerBuffer q_texels;
layout(binding = 2) writeonly buffer Right { vec4 right_side[]; };
layout(binding = 3) writeonly buffer Coarse { vec2 coarse[]; };
#elif defined(READING_SHADING)
layout(binding = 0) uniform usamplerBuffer filtered;  // four 16-bit pixels to a texel
layout(binding = 1) writeonly buffer Right { vec4 right_side[]; };
layout(binding = 2) writeonly buffer Coarse { vec2 coarse[]; };
#else
layout(binding = 0) uniform usamplerBuffer frame_words;  // four 8-bit pixels to a word, planes red, green, blue
layout(binding = 1) uniform usamplerBuffer rest_words;
layout(binding = 2) writeonly buffer Right { vec4 right_side[]; };
layout(binding = 3) writeonly buffer Coarse { vec2 coarse[]; };
#endif

// Slopes of one row around texel tx: p in columns -2 .. 5 (two groups of four), q in columns 0 .. 3.
struct Slopes {
  vec4 p_a, p_b, q;
};

#if defined(READING_GIVEN)

struct Window {
  uint unused;
};
Window window_at(int tx, int y) { return Window(0); }

Slopes slopes_at(inout Window window, int tx, int y) {
  int row = clamp(y, 0, int(push.height) - 1) * int(push.in_pitch);
  vec4 left = texelFetch(p_texels, row + max(tx - 1, 0));
  vec4 here = texelFetch(p_texels, row + tx);
  vec4 right = texelFetch(p_texels, row + min(tx + 1, int(push.in_pitch) - 1));
  return Slopes(vec4(left.zw, here.xy), vec4(here.zw, right.xy), texelFetch(q_texels, row + tx));
}

#elif defined(READING_SHADING)

vec4 unpack(uvec2 w) { return vec4(w.x & 0xffffu, w.x >> 16, w.y & 0xffffu, w.y >> 16); }

struct Gray {
  vec4 l, c, r;  // columns -4 .. -1, 0 .. 3, 4 .. 7
};

Gray gray_at(int tx, int y) {
  int row = clamp(y, 0, int(push.height) - 1) * int(push.in_pitch);
  int first = 4 * tx, width = int(push.width);
  Gray g;
  g.c = unpack(texelFetch(filtered, row + tx).xy);
  g.l = tx > 0 ? unpack(texelFetch(filtered, row + max(tx - 1, 0)).xy) : g.c.xxxx;
  g.r = unpack(texelFetch(filtered, row + min(tx + 1, int(push.in_pitch) - 1)).xy);
  // Beyond the last column the edge is repeated.
  g.c.y = first + 1 < width ? g.c.y : g.c.x;
  g.c.z = first + 2 < width ? g.c.z : g.c.y;
  g.c.w = first + 3 < width ? g.c.w : g.c.z;
  g.r.x = first + 4 < width ? g.r.x : g.c.w;
  g.r.y = first + 5 < width ? g.r.y : g.r.x;
  g.r.z = first + 6 < width ? g.r.z : g.r.y;
  return g;
}

// Lambert with the light along the viewing axis: gray / facing = cos(slope angle), so |slope| = tan of it (Eq. 62-63); the
// surface falls away from the light in the direction in which the gray falls. Without contact there is no reading: slope 0.
void shade(vec4 gray, vec4 dx, vec4 dy, out vec4 p, out vec4 q) {
  // tan^2 = facing^2 / gray^2 - 1, over the gradient's squared size: one division and one root for each pixel.
  vec4 gray2 = max(gray * gray, vec4(1e-12)), steepest2 = gray2 * (push.max_slope * push.max_slope);
  vec4 tangent2 = min(max(push.facing * push.facing - gray2, vec4(0.0)), steepest2);
  vec4 scale = push.gain * sqrt(tangent2 / (gray2 * max(dx * dx + dy * dy, vec4(1e-12))));
  scale = mix(scale, vec4(0.0), lessThan(gray, vec4(max(push.threshold, 1e-6))));
  p = scale * dx;
  q = scale * dy;
}

// Rows y - 1 and y; slopes_at takes them along, so that each row is fetched once.
struct Window {
  Gray up, here;
};
Window window_at(int tx, int y) { return Window(gray_at(tx, y - 1), gray_at(tx, y)); }

Slopes slopes_at(inout Window window, int tx, int y) {
  Gray up = window.up, here = window.here, down = gray_at(tx, y + 1);
  window.up = here;
  window.here = down;
  Gray s = Gray(up.l + 2.0 * here.l + down.l, up.c + 2.0 * here.c + down.c, up.r + 2.0 * here.r + down.r);
  Gray d = Gray(down.l - up.l, down.c - up.c, down.r - up.r);
  vec4 dx_a = vec4(s.l.w, s.c.xyz) - vec4(s.l.yzw, s.c.x);
  vec4 dx_b = vec4(s.c.w, s.r.xyz) - vec4(s.c.yzw, s.r.x);
  vec4 dy_a = vec4(d.l.w, d.c.xyz) + 2.0 * vec4(d.l.zw, d.c.xy) + vec4(d.l.yzw, d.c.x);
  vec4 dy_b = vec4(d.c.w, d.r.xyz) + 2.0 * vec4(d.c.zw, d.r.xy) + vec4(d.c.yzw, d.r.x);
  Slopes result;
  vec4 q_a, q_b;
  shade(vec4(here.l.zw, here.c.xy), dx_a, dy_a, result.p_a, q_a);
  shade(vec4(here.c.zw, here.r.xy), dx_b, dy_b, result.p_b, q_b);
  result.q = vec4(q_a.zw, q_b.xy);
  return result;
}

#else

vec4 unpack(uint w) { return vec4(w & 255u, (w >> 8) & 255u, (w >> 16) & 255u, w >> 24); }

// Unit normal, linear in the change of colour with weights that vary linearly across the frame; then slope = n_xy / n_z.
void lean(vec4 x, float y, vec4 red, vec4 green, vec4 blue, out vec4 p, out vec4 q) {
  vec4 nx = (push.wx[0] + push.wx[1] * x + push.wx[2] * y) * red + (push.wx[3] + push.wx[4] * x + push.wx[5] * y) * green +
            (push.wx[6] + push.wx[7] * x + push.wx[8] * y) * blue;
  vec4 ny = (push.wy[0] + push.wy[1] * x + push.wy[2] * y) * red + (push.wy[3] + push.wy[4] * x + push.wy[5] * y) * green +
            (push.wy[6] + push.wy[7] * x + push.wy[8] * y) * blue;
  vec4 flat_part = nx * nx + ny * ny;
  // A slope of max_slope has n_z = 1 / sqrt(1 + max_slope^2); beyond it keep the direction and clip the size.
  float steepest = push.max_slope * push.max_slope / (1.0 + push.max_slope * push.max_slope);
  vec4 nz = sqrt(max(1.0 - flat_part, vec4(1.0 - steepest)));
  vec4 scale = min(vec4(1.0) / nz, push.max_slope * inversesqrt(max(flat_part, vec4(1e-20))));
  p = nx * scale;
  q = ny * scale;
}

void color_at(int plane, int row, int tx, out vec4 a, out vec4 b) {
  int at = (plane * int(push.height) + row) * int(push.in_pitch) * 4 + 4 + tx;
  uint il = texelFetch(frame_words, at - 1).x, ic = texelFetch(frame_words, at).x, ir = texelFetch(frame_words, at + 1).x;
  uint rl = texelFetch(rest_words, at - 1).x, rc = texelFetch(rest_words, at).x, rr = texelFetch(rest_words, at + 1).x;
  a = (unpack((il >> 16) | (ic << 16)) - unpack((rl >> 16) | (rc << 16))) * push.threshold;
  b = (unpack((ic >> 16) | (ir << 16)) - unpack((rc >> 16) | (rr << 16))) * push.threshold;
}

struct Window {
  uint unused;
};
Window window_at(int tx, int y) { return Window(0); }

Slopes slopes_at(inout Window window, int tx, int y) {
  int row = clamp(y, 0, int(push.height) - 1);
  vec4 red_a, red_b, green_a, green_b, blue_a, blue_b;
  color_at(0, row, tx, red_a, red_b);
  color_at(1, row, tx, green_a, green_b);
  color_at(2, row, tx, blue_a, blue_b);
  vec4 column = vec4(-2, -1, 0, 1) + float(4 * tx);
  vec4 x_a = (2.0 * column + 1.0) / float(push.width) - 1.0;
  vec4 x_b = (2.0 * column + 9.0) / float(push.width) - 1.0;
  float y_at = (2.0 * float(row) + 1.0) / float(push.height) - 1.0;
  Slopes result;
  vec4 q_a, q_b;
  lean(x_a, y_at, red_a, green_a, blue_a, result.p_a, q_a);
  lean(x_b, y_at, red_b, green_b, blue_b, result.p_b, q_b);
  result.q = vec4(q_a.zw, q_b.xy);
  return result;
}

#endif

// Weights of samples i - 1 .. i + 2 in the integral from i to i + 1: exact for cubics inside; beside an edge the missing sample is
// extrapolated linearly; outside there is no pair and no equation.
vec4 pair_weights(int i, int n) {
  bool before = i >= 1, after = i + 2 < n;
  vec4 w = vec4(before ? -1.0 : 0.0, 12.0, 12.0, after ? -1.0 : 0.0);
  w.y += (before ? 1.0 : 0.0) + (before && !after ? 1.0 : 0.0) - (!before && after ? 1.0 : 0.0);
  w.z += (after ? 1.0 : 0.0) + (after && !before ? 1.0 : 0.0) - (!after && before ? 1.0 : 0.0);
  return (i >= 0 && i + 1 < n) ? w / 24.0 : vec4(0.0);
}

// Columns' part of the right side: for each of columns 0 .. 3 the pair to its left minus the pair to its right.
vec4 across(Slopes s, vec4 w0, vec4 w1, vec4 w2, vec4 w3, vec4 w4) {
  float f0 = dot(s.p_a, w0);
  float f1 = dot(vec4(s.p_a.yzw, s.p_b.x), w1);
  float f2 = dot(vec4(s.p_a.zw, s.p_b.xy), w2);
  float f3 = dot(vec4(s.p_a.w, s.p_b.xyz), w3);
  float f4 = dot(s.p_b, w4);
  return vec4(f0, f1, f2, f3) - vec4(f1, f2, f3, f4);
}

// What the last rows leave for the next: slopes down the columns of four rows, the column part of two, and the integral across the
// pair of rows above the one to be finished.
struct Stream {
  Window window;
  vec4 q3, q2, q1, q0;
  vec4 across2, across1;
  vec4 above;
};

// Takes in row y and gives the right side of row y - 2, in height differences of one px.
vec4 take_row(inout Stream t, int tx, int y, vec4 w0, vec4 w1, vec4 w2, vec4 w3, vec4 w4) {
  Slopes s = slopes_at(t.window, tx, y);
  t.q3 = t.q2;
  t.q2 = t.q1;
  t.q1 = t.q0;
  t.q0 = s.q;
  vec4 wy = pair_weights(y - 2, int(push.height));
  vec4 below = t.q3 * wy.x + t.q2 * wy.y + t.q1 * wy.z + t.q0 * wy.w;
  vec4 right = t.across2 + t.above - below;
  t.above = below;
  t.across2 = t.across1;
  t.across1 = across(s, w0, w1, w2, w3, w4);
  return right;
}

void main() {
  uint tiles_y = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.pitch * tiles_y) return;
  int tx = int(tile % push.pitch);
  int y0 = int(tile / push.pitch * TILE_ROWS);
  int width = int(push.width), height = int(push.height);
  int x0 = 4 * tx;
  vec4 w0 = pair_weights(x0 - 1, width), w1 = pair_weights(x0, width), w2 = pair_weights(x0 + 1, width),
       w3 = pair_weights(x0 + 2, width), w4 = pair_weights(x0 + 3, width);

  // The pair between rows y and y + 1 needs rows y - 1 .. y + 2, so the column part of a row waits two rows.
  Stream stream;
  stream.window = window_at(tx, y0 - 2);
  Slopes s = slopes_at(stream.window, tx, y0 - 2);
  stream.q3 = stream.above = stream.across2 = vec4(0.0);
  stream.q2 = s.q;
  s = slopes_at(stream.window, tx, y0 - 1);
  stream.q1 = s.q;
  s = slopes_at(stream.window, tx, y0);
  stream.q0 = s.q;
  stream.across1 = across(s, w0, w1, w2, w3, w4);
  take_row(stream, tx, y0 + 1, w0, w1, w2, w3, w4);
  bvec4 inside = lessThan(ivec4(0, 1, 2, 3) + x0, ivec4(width));
  for (int y = y0; y < y0 + int(TILE_ROWS); y += 2) {
    vec4 upper = take_row(stream, tx, y + 2, w0, w1, w2, w3, w4) * push.scale;
    vec4 lower = take_row(stream, tx, y + 3, w0, w1, w2, w3, w4) * push.scale;
    if (y < height) right_side[uint(y) * push.pitch + uint(tx)] = upper;
    if (y + 1 < height) right_side[uint(y + 1) * push.pitch + uint(tx)] = lower;
    lower = y + 1 < height ? lower : vec4(0.0);
    vec4 sum = mix(vec4(0.0), upper + lower, inside);
    if (y < height) coarse[uint(y / 2) * push.coarse_pitch + uint(tx)] = sum.xz + sum.yw;
  }
}
