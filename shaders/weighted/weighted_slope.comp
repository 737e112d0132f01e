// Pixels and their confidence to the weighted surface problem on cells of two by two pixels: the right side of its normal equations,
// and with FACES the weights of the cells' faces. Integrals across pixel faces are those of weighted_faces.comp, summed over each
// cell's; faces inside a cell cancel. Where all is known the right side is that of slope_coarse.comp.
// An invocation owns eight columns and TILE_ROWS rows, an even number.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/confidence.h"
#include "shaders/shared/slope.h"
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { SlopePush push; };
#include "shaders/surface/slope_methods.glsl"

TEXELS(FIRST_OUTPUT, uvec2, confidence_pairs);  // four pixels to a pair of words
layout(binding = FIRST_OUTPUT + 1) writeonly buffer Right { vec4 right_side[]; };
#ifdef FACES
layout(binding = FIRST_OUTPUT + 2) writeonly buffer Across { vec4 wx[]; };
layout(binding = FIRST_OUTPUT + 3) writeonly buffer Down { vec4 wy[]; };
layout(binding = FIRST_OUTPUT + 4) writeonly buffer Field { float field[]; };
#endif

// The integral from b to c of the cubic through a, b, c, d; an outer sample counts as far as it is known as well as the pair, what is
// missing goes on linearly.
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

// One row: the slope down and the weight in columns 0 .. 7; across the left faces of the four cells and the right one of the last,
// the weight and the weighted difference.
struct Row {
  vec4 q_a, q_b, w_a, w_b;
  vec4 weight, flow;
  float last_weight, last_flow;
};

vec4 unpack_confidence(uint l, uint r) {
  return vec4(l & 255u, (l >> 16) & 255u, r & 255u, (r >> 16) & 255u) * (1.0 / float(kFullConfidence));
}

Row row_at(Window window, inout Clipped clipped, int tx, int y) {
  int width = int(push.width), height = int(push.height), pairs = (width + 15) / 16 * 4;
  int row = clamp(y, 0, height - 1) * pairs;
  uvec2 left = texelFetch(confidence_pairs, row + max(2 * tx - 1, 0)).xy, c = texelFetch(confidence_pairs, row + 2 * tx).xy;
  uvec2 d = texelFetch(confidence_pairs, row + 2 * tx + 1).xy, right = texelFetch(confidence_pairs, row + min(2 * tx + 2, pairs - 1)).xy;
  ivec4 column = ivec4(-2, -1, 0, 1) + 8 * tx;
  bvec4 inside = lessThan(uvec4(column), uvec4(width));
  bool here = y >= 0 && y < height;
  vec4 w_a = unpack_confidence(left.y, c.x) * vec4(inside), w_b = unpack_confidence(c.y, d.x) * vec4(lessThan(column + 4, ivec4(width)));
  vec4 w_c = unpack_confidence(d.y, right.x) * vec4(lessThan(column + 8, ivec4(width)));
  w_a = here ? w_a : vec4(0.0);
  w_b = here ? w_b : vec4(0.0);
  w_c = here ? w_c : vec4(0.0);
  Slopes s = slopes_at(window, tx, y, clipped);
  Row r;
  r.q_a = s.q_a;
  r.q_b = s.q_b;
  r.w_a = vec4(w_a.zw, w_b.xy);
  r.w_b = vec4(w_b.zw, w_c.xy);
  vec4 wc = vec4(w_a.z, w_b.xz, w_c.x);
  r.weight = min(vec4(w_a.yw, w_b.yw), wc);
  r.flow = r.weight * between(vec4(s.p_a.xz, s.p_b.xz), vec4(s.p_a.yw, s.p_b.yw), vec4(s.p_a.z, s.p_b.xz, s.p_c.x),
                              vec4(s.p_a.w, s.p_b.yw, s.p_c.y), vec4(w_a.xz, w_b.xz), vec4(w_a.w, w_b.yw, w_c.y), r.weight);
  r.last_weight = min(w_c.y, w_c.z);
  r.last_flow = r.last_weight * between(s.p_c.x, s.p_c.y, s.p_c.z, s.p_c.w, w_c.x, w_c.w, r.last_weight);
  return r;
}

vec4 pair_sums(vec4 a, vec4 b) { return vec4(a.xz + a.yw, b.xz + b.yw); }

// What two rows leave for the next two: themselves, the cells' part along the row, and what flows across the face above.
struct Stream {
  Row upper, lower;
  vec4 above;
};

// Faces inside the frame that say nothing keep a small negative weight.
vec4 stored(vec4 w, bvec4 inside) { return mix(vec4(0.0), mix(vec4(-kUnknownFace), w, greaterThan(w, vec4(0.0))), inside); }
vec4 energy(vec4 flow, vec4 w) { return flow * flow / max(w, vec4(1e-30)); }

// Middles of cells are two pixels apart; that of the last of an odd frame one and a half.
vec4 per_distance(ivec4 next, int size) { return mix(vec4(0.5), vec4(2.0 / 3.0), equal(next + 1, ivec4(size))); }

// Takes in rows y and y + 1 and finishes the cells of the two before.
void take_rows(inout Stream t, inout Clipped clipped, inout vec4 misfit, Window window, int tx, int y, bool own) {
  Row upper = row_at(window, clipped, tx, y), lower = row_at(window, clipped, tx, y + 1);
  vec4 w_a = min(t.lower.w_a, upper.w_a), w_b = min(t.lower.w_b, upper.w_b);
  vec4 flow_a = w_a * between(t.upper.q_a, t.lower.q_a, upper.q_a, lower.q_a, t.upper.w_a, lower.w_a, w_a);
  vec4 flow_b = w_b * between(t.upper.q_b, t.lower.q_b, upper.q_b, lower.q_b, t.upper.w_b, lower.w_b, w_b);
  vec4 below = pair_sums(flow_a, flow_b);
  vec4 flow = t.upper.flow + t.lower.flow;
  float last_flow = t.upper.last_flow + t.lower.last_flow;
  if (own) {
    uint cell = uint(y - 2) / 2 * push.coarse_pitch + uint(tx);
    right_side[cell] = flow - vec4(flow.yzw, last_flow) + t.above - below;
#ifdef FACES
    ivec4 next = ivec4(2, 4, 6, 8) + 8 * tx, columns = next - 2;
    int width = int(push.width), height = int(push.height);
    vec4 across = vec4(t.upper.weight.yzw + t.lower.weight.yzw, t.upper.last_weight + t.lower.last_weight) * per_distance(next, width);
    vec4 down = pair_sums(w_a, w_b) * per_distance(ivec4(y), height).x;
    wx[cell] = stored(across, lessThan(next, ivec4(width)));
    wy[cell] = stored(down, lessThan(columns, ivec4(y < height ? width : 0)));
    misfit += energy(vec4(flow.yzw, last_flow), across) + energy(below, down);
#endif
  }
  t = Stream(upper, lower, below);
}

void main() {
  uint tiles_x = push.coarse_pitch, tiles_y = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles_y) return;
  int tx = int(tile % tiles_x), y0 = int(tile / tiles_x * TILE_ROWS), end = y0 + int(TILE_ROWS) + 2;
  const vec4 none = vec4(0.0);
  Row nothing = Row(none, none, none, none, none, none, 0.0, 0.0);
  Stream stream = Stream(nothing, nothing, none);
  Clipped clipped = none_clipped(y0);
  vec4 misfit = none;
  // Rows are taken two ahead of the cells they finish; the window changes with every eight rows.
  int y = y0 - 2, next = y0;
  do {
    Window window = window_at(tx, y);
    do {
      take_rows(stream, clipped, misfit, window, tx, y, y > y0 && y < int(push.height) + 2);
      y += 2;
    } while (y < min(next, end));
    next += 8;
  } while (y < end);
  store_clipped(clipped, tile, tx);
#ifdef FACES
  field[tile] = misfit.x + misfit.y + misfit.z + misfit.w;
#endif
}
