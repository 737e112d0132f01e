// The end of a cycle: the present solution plus the linearly interpolated coarse correction, and two Chebyshev-Jacobi sweeps, in one
// pass over a level.
// An invocation owns four columns and streams down push.rows rows; both sweeps live in registers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };

TEXELS(0, vec4, right_texels);
TEXELS(1, float, right_words);
TEXELS(2, vec2, coarse_pairs);
TEXELS(3, vec4, present_texels);
layout(binding = 4) writeonly buffer Out { vec4 result[]; };

#include "shaders/surface/coarse_row.glsl"

Eight present_row(int tx, int y) {
  int row = clamp(y, 0, int(push.height) - 1) * int(push.pitch);
  vec4 l = texelFetch(present_texels, row + max(tx - 1, 0));
  vec4 c = texelFetch(present_texels, row + tx);
  vec4 r = texelFetch(present_texels, row + min(tx + 1, int(push.pitch) - 1));
  return Eight(vec4(l.zw, c.xy), vec4(c.zw, r.xy));
}

// Columns -1 .. 4 of the right side and of the first sweep's result.
struct Sweep {
  vec4 m;
  float l, r;
};

Sweep right_row(int tx, int y) {
  int row = clamp(y, 0, int(push.height) - 1) * int(push.pitch);
  Sweep f;
  f.m = texelFetch(right_texels, row + tx);
  f.l = texelFetch(right_words, 4 * row + max(4 * tx - 1, 0)).x;
  f.r = texelFetch(right_words, 4 * row + min(4 * tx + 4, 4 * int(push.pitch) - 1)).x;
  return f;
}

Sweep with_ghosts(Sweep s, int first, int width) {
  s.l = choose(first == 0, s.m.x, s.l);
  s.m.y = choose(first + 1 < width, s.m.y, s.m.x);
  s.m.z = choose(first + 2 < width, s.m.z, s.m.y);
  s.m.w = choose(first + 3 < width, s.m.w, s.m.z);
  s.r = choose(first + 4 < width, s.r, s.m.w);
  return s;
}

struct State {
  Eight above, here;       // start values of rows j - 1 and j
  Sweep first_2, first_1;  // first sweep at rows j - 2 and j - 1
  vec4 right_1;            // right side at row j - 1
};

// Takes the start values of row j + 1, sweeps row j once and finishes row j - 1.
void advance(inout State s, Eight below, int j, int tx, int y0, Couplings k) {
  int height = int(push.height), first = 4 * tx, width = int(push.width);
  Sweep f = right_row(tx, j);
  Sweep once;
  bool top = j <= 0, bottom = j >= height - 1;
  vec4 c = mid(s.here);
  vec4 u = choose(top, c, mid(s.above)), d = choose(bottom, c, mid(below));
  vec4 l = vec4(s.here.a.yzw, s.here.b.x), r = vec4(s.here.a.w, s.here.b.xyz);
  vec3 row = row_couplings(push, j);
  once.m = c + push.step0 * (f.m - apply(k, row, c, l, r, u, d));
  // The two cells beside the texel. The left one is never in the last column; the right one may be.
  float cl = s.here.a.y, cr = s.here.b.z;
  float ul = choose(top, cl, s.above.a.y), dl = choose(bottom, cl, below.a.y);
  float ur = choose(top, cr, s.above.b.z), dr = choose(bottom, cr, below.b.z);
  float nearer = 2.0 / (1.0 + push.edge_width), after = first + 5 == width - 1 ? nearer : 1.0;
  bool last = first + 4 == width - 1;
  once.l = cl + push.step0 * (f.l - row.z * (push.across * (cl - s.here.a.x) + k.left.x * (cl - s.here.a.z)) -
                              push.down * (row.x * (cl - ul) + row.y * (cl - dl)));
  once.r = cr + push.step0 * (f.r - row.z * push.across * ((last ? nearer : 1.0) * (cr - s.here.b.y) + after * (cr - s.here.b.w)) -
                              push.down * (last ? push.edge_width : 1.0) * (row.x * (cr - ur) + row.y * (cr - dr)));
  once = with_ghosts(once, first, width);

  int y = j - 1;
  vec4 c1 = s.first_1.m;
  vec4 u1 = choose(y <= 0, c1, s.first_2.m), d1 = choose(y >= height - 1, c1, once.m);
  vec4 l1 = vec4(s.first_1.l, c1.xyz), r1 = vec4(c1.yzw, s.first_1.r);
  vec4 twice = c1 + push.step1 * (s.right_1 - apply(k, row_couplings(push, y), c1, l1, r1, u1, d1));
  if (y >= y0 && y < min(y0 + int(push.rows), height)) result[uint(y) * push.pitch + uint(tx)] = twice;

  s.above = s.here;
  s.here = below;
  s.first_2 = s.first_1;
  s.first_1 = once;
  s.right_1 = f.m;
}

void main() {
  uint tiles_y = (push.height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.pitch * tiles_y) return;
  int tx = int(tile % push.pitch);
  int y0 = int(tile / push.pitch * push.rows);
  int first = 4 * tx, width = int(push.width);

  Couplings couple = couplings(push, first);
  Eight none = Eight(vec4(0), vec4(0));
  State s = State(none, none, Sweep(vec4(0), 0, 0), Sweep(vec4(0), 0, 0), vec4(0));
  // Two fine rows for each coarse row k, from row y0 - 2 to row y0 + rows + 1.
  int k = y0 / 2 - 1, height = int(push.height);
  Eight far = far_weights(push, first);
  Eight before = coarse_row(tx, k - 1, far), here = coarse_row(tx, k, far);
  for (int i = 0; i < int(push.rows) / 2 + 2; ++i, ++k) {
    Eight after = coarse_row(tx, k + 1, far);
    Eight upper = blend(here, before, far_weight(2 * k, height, push.edge_height));
    Eight lower = blend(here, after, far_weight(2 * k + 1, height, push.edge_height));
    Eight p = present_row(tx, 2 * k);
    upper = Eight(upper.a + p.a, upper.b + p.b);
    p = present_row(tx, 2 * k + 1);
    lower = Eight(lower.a + p.a, lower.b + p.b);
    advance(s, with_ghosts(upper, first, width), 2 * k - 1, tx, y0, couple);
    advance(s, with_ghosts(lower, first, width), 2 * k, tx, y0, couple);
    before = here;
    here = after;
  }
}
