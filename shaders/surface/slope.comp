// Pixels to the right side of the least-squares surface problem: slopes p = d(depth)/dx, q = d(depth)/dy at pixel centres, their
// integrals across each pair of neighbours (fourth order), and the divergence of those; and its sums over two by two pixels, the
// right side of the next coarser level. Slopes are never stored.
// An invocation owns eight columns and TILE_ROWS rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/slope.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { SlopePush push; };

#include "shaders/surface/slope_methods.glsl"

layout(binding = FIRST_OUTPUT) writeonly buffer Right { vec4 right_side[]; };
layout(binding = FIRST_OUTPUT + 1) writeonly buffer Coarse { vec4 coarse[]; };

// The integral from sample b to c of the cubic through a, b, c, d.
vec4 pair(vec4 a, vec4 b, vec4 c, vec4 d) { return (13.0 * (b + c) - a - d) / 24.0; }

// Constant from row to row: 1 for each pair of columns inside the frame, from (-1, 0) to (7, 8).
struct Edges {
  vec4 pairs_a, pairs_b;
  float pair_c;
};

// Columns' part of the right side: for each column the pair to its left minus the pair to its right. Beyond the first and the last
// column p goes on linearly, which makes the pair beside an edge exact for parabolas.
struct Across {
  vec4 a, b;
};
Across across(Slopes s, Edges edges, int first) {
  int width = int(push.width);
  s.p_a.y = first == 0 ? 2.0 * s.p_a.z - s.p_a.w : s.p_a.y;
  s.p_a.w = first + 1 == width ? 2.0 * s.p_a.z - s.p_a.y : s.p_a.w;
  ivec4 column = ivec4(2, 3, 4, 5) + first;
  s.p_b = mix(s.p_b, 2.0 * vec4(s.p_a.w, s.p_b.xyz) - vec4(s.p_a.zw, s.p_b.xy), equal(column, ivec4(width)));
  s.p_c = mix(s.p_c, 2.0 * vec4(s.p_b.w, s.p_c.xyz) - vec4(s.p_b.zw, s.p_c.xy), equal(column + 4, ivec4(width)));
  vec4 f_a = edges.pairs_a * pair(s.p_a, vec4(s.p_a.yzw, s.p_b.x), vec4(s.p_a.zw, s.p_b.xy), vec4(s.p_a.w, s.p_b.xyz));
  vec4 f_b = edges.pairs_b * pair(s.p_b, vec4(s.p_b.yzw, s.p_c.x), vec4(s.p_b.zw, s.p_c.xy), vec4(s.p_b.w, s.p_c.xyz));
  float f_c = edges.pair_c * (13.0 * (s.p_c.y + s.p_c.z) - s.p_c.x - s.p_c.w) / 24.0;
  return Across(f_a - vec4(f_a.yzw, f_b.x), f_b - vec4(f_b.yzw, f_c));
}

// What the last rows leave for the next: q of three rows, the column part of two, and the integral across the pair of rows above
// the one to be finished.
struct Stream {
  Window window;
  Clipped clipped;
  vec4 q2_a, q2_b, q1_a, q1_b, q0_a, q0_b;
  Across across2, across1;
  vec4 above_a, above_b;
};

// Takes in row y and gives the right side of row y - 2, in height differences of one px. The pair between rows y - 2 and y - 1
// needs rows y - 3 .. y, so the column part of a row waits two rows.
Across take_row(inout Stream t, Edges edges, int tx, int y) {
  Slopes s = slopes_at(t.window, tx, y, t.clipped);
  int height = int(push.height);
  bool top = y - 3 < 0, bottom = y >= height;
  vec4 before_a = top ? 2.0 * t.q1_a - t.q0_a : t.q2_a, before_b = top ? 2.0 * t.q1_b - t.q0_b : t.q2_b;
  vec4 after_a = bottom ? 2.0 * t.q0_a - t.q1_a : s.q_a, after_b = bottom ? 2.0 * t.q0_b - t.q1_b : s.q_b;
  float inside = (y >= 2 && y - 1 < height) ? 1.0 : 0.0;
  vec4 below_a = inside * pair(before_a, t.q1_a, t.q0_a, after_a), below_b = inside * pair(before_b, t.q1_b, t.q0_b, after_b);
  Across right = Across(t.across2.a + t.above_a - below_a, t.across2.b + t.above_b - below_b);
  t.q2_a = t.q1_a;
  t.q2_b = t.q1_b;
  t.q1_a = t.q0_a;
  t.q1_b = t.q0_b;
  t.q0_a = s.q_a;
  t.q0_b = s.q_b;
  t.above_a = below_a;
  t.above_b = below_b;
  t.across2 = t.across1;
  t.across1 = across(s, edges, 8 * tx);
  return right;
}

// Takes in rows y + 2 and y + 3 and finishes rows y and y + 1, those from `first` on.
void finish_rows(inout Stream stream, Edges edges, int tx, int first, int y) {
  const vec4 none = vec4(0.0);
  int end = y < first ? y : int(push.height);
  Across upper = take_row(stream, edges, tx, y + 2), lower = take_row(stream, edges, tx, y + 3);
  uint texel = uint(y) * push.pitch + 2 * uint(tx);
  bool wide = 2 * uint(tx) + 1 < push.pitch;
  upper = Across(upper.a * push.scale, upper.b * push.scale);
  lower = Across(lower.a * push.scale, lower.b * push.scale);
  if (y < end) {
    right_side[texel] = upper.a;
    if (wide) right_side[texel + 1] = upper.b;
  }
  if (y + 1 < end) {
    right_side[texel + push.pitch] = lower.a;
    if (wide) right_side[texel + push.pitch + 1] = lower.b;
  }
  ivec4 column = ivec4(0, 1, 2, 3) + 8 * tx;
  vec4 sum_a = upper.a + (y + 1 < end ? lower.a : none), sum_b = upper.b + (y + 1 < end ? lower.b : none);
  sum_a = mix(none, sum_a, lessThan(column, ivec4(push.width)));
  sum_b = mix(none, sum_b, lessThan(column + 4, ivec4(push.width)));
  if (y < end) coarse[uint(y / 2) * push.coarse_pitch + uint(tx)] = vec4(sum_a.xz + sum_a.yw, sum_b.xz + sum_b.yw);
}

void main() {
  uint tiles_x = (push.pitch + 1) / 2, tiles_y = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles_y) return;
  int tx = int(tile % tiles_x);
  int y0 = int(tile / tiles_x * TILE_ROWS), y1 = y0 + int(TILE_ROWS);
  ivec4 column = ivec4(0, 1, 2, 3) + 8 * tx;
  Edges edges;
  edges.pairs_a = vec4(lessThan(column, ivec4(push.width)));
  edges.pairs_a.x = tx == 0 ? 0.0 : edges.pairs_a.x;
  edges.pairs_b = vec4(lessThan(column + 4, ivec4(push.width)));
  edges.pair_c = 8 * tx + 8 < int(push.width) ? 1.0 : 0.0;

  const vec4 none = vec4(0.0);
  Stream stream;
  stream.clipped = none_clipped(y0);
  stream.q2_a = stream.q2_b = stream.q1_a = stream.q1_b = stream.q0_a = stream.q0_b = none;
  stream.above_a = stream.above_b = none;
  stream.across2 = stream.across1 = Across(none, none);
  // Rows are taken two ahead of those they finish, and the first four finish none; the window changes with every eight rows taken.
  // Taken in one place: each costs the driver a copy of slopes_at.
  int y = y0 - 4;
  for (int next = y0 - 2; y < y1; next += 8) {
    stream.window = window_at(tx, y + 2);
    for (; y < min(next, y1); y += 2) finish_rows(stream, edges, tx, y0, y);
  }
  store_clipped(stream.clipped, tile, tx);
}
