// The way up of a full-multigrid pass, in one pass over a level: the coarser level's heights interpolated by cubics, two
// Chebyshev-Jacobi sweeps, and what they leave of the right side, summed over blocks of two by two cells for the coarser level.
// An invocation owns eight columns and streams down push.rows rows of the coarser level; all sweeps live in registers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"
#include "shaders/frame/cubic.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, vec4, right_texels);
TEXELS(1, vec2, right_pairs);
TEXELS(2, vec4, coarse_texels);
layout(binding = 3) writeonly buffer Out { vec4 result[]; };
layout(binding = 4) writeonly buffer Coarse { vec4 coarse[]; };

#include "shaders/frame/columns.glsl"
#include "shaders/surface/sweeps.glsl"

// Start values in columns -4 .. 11.
struct Sixteen {
  vec4 l, a, b, r;
};

Sixteen blend(vec4 w, Sixteen far2, Sixteen far, Sixteen here, Sixteen near) {
  return Sixteen(w.x * far2.l + w.y * far.l + w.z * here.l + w.w * near.l, w.x * far2.a + w.y * far.a + w.z * here.a + w.w * near.a,
                 w.x * far2.b + w.y * far.b + w.z * here.b + w.w * near.b, w.x * far2.r + w.y * far.r + w.z * here.r + w.w * near.r);
}
Sixteen onward(Sixteen here, Sixteen before) {
  return Sixteen(2.0 * here.l - before.l, 2.0 * here.a - before.a, 2.0 * here.b - before.b, 2.0 * here.r - before.r);
}
Sixteen choose(bool first, Sixteen a, Sixteen b) {
  return Sixteen(choose(first, a.l, b.l), choose(first, a.a, b.a), choose(first, a.b, b.b), choose(first, a.r, b.r));
}
Twelve choose(bool first, Twelve a, Twelve b) {
  return Twelve(choose(first, a.l, b.l), choose(first, a.a, b.a), choose(first, a.b, b.b), choose(first, a.r, b.r));
}

// Weights for the even and the odd columns of -4 .. 3 and of 4 .. 11.
struct Across {
  Cubics even_l, odd_l, even_r, odd_r;
};

// One row of the coarser level's heights. Columns -4 and 11 are never asked for, nor what lies left of the frame.
Sixteen height_row(int tx, int k, Across w) {
  int pitch = int(push.coarse_pitch), row = clamp(k, 0, int(push.coarse_height) - 1) * pitch;
  int width = int(push.coarse_width), first = 4 * tx;
  vec4 l = texelFetch(coarse_texels, row + max(tx - 1, 0)), c = texelFetch(coarse_texels, row + tx),
       r = texelFetch(coarse_texels, row + min(tx + 1, pitch - 1));
  l.w = choose(first == 0, c.x, l.w);
  c.y = choose(first + 1 < width, c.y, 2.0 * c.x - l.w);
  c.z = choose(first + 2 < width, c.z, 2.0 * c.y - c.x);
  c.w = choose(first + 3 < width, c.w, 2.0 * c.z - c.y);
  r.x = choose(first + 4 < width, r.x, 2.0 * c.w - c.z);
  r.y = choose(first + 5 < width, r.y, 2.0 * r.x - c.w);
  r.z = choose(first + 6 < width, r.z, 2.0 * r.y - r.x);
  r.w = choose(first + 7 < width, r.w, 2.0 * r.z - r.y);
  l.w = choose(first == 0, 2.0 * c.x - c.y, l.w);
  l.z = choose(first == 0, 2.0 * l.w - c.x, l.z);
  // Columns -4 .. 3 lie over cells -2 .. 1, columns 4 .. 11 over cells 2 .. 5.
  vec4 m2 = l, m1 = vec4(l.yzw, c.x), here = vec4(l.zw, c.xy), p1 = vec4(l.w, c.xyz), p2 = c;
  vec4 e = blend(w.even_l, m2, m1, here, p1), o = blend(w.odd_l, p2, p1, here, m1);
  vec4 n2 = c, n1 = vec4(c.yzw, r.x), there = vec4(c.zw, r.xy), q1 = vec4(c.w, r.xyz), q2 = r;
  vec4 f = blend(w.even_r, n2, n1, there, q1), p = blend(w.odd_r, q2, q1, there, n1);
  return Sixteen(vec4(e.x, o.x, e.y, o.y), vec4(e.z, o.z, e.w, o.w), vec4(f.x, p.x, f.y, p.y), vec4(f.z, p.z, f.w, p.w));
}

Sixteen with_ghosts(Sixteen s, int first) {
  int width = int(push.width);
  s.l.w = choose(first == 0, s.a.x, s.l.w);
  s.a.y = choose(first + 1 < width, s.a.y, s.a.x);
  s.a.z = choose(first + 2 < width, s.a.z, s.a.y);
  s.a.w = choose(first + 3 < width, s.a.w, s.a.z);
  s.b.x = choose(first + 4 < width, s.b.x, s.a.w);
  s.b.y = choose(first + 5 < width, s.b.y, s.b.x);
  s.b.z = choose(first + 6 < width, s.b.z, s.b.y);
  s.b.w = choose(first + 7 < width, s.b.w, s.b.z);
  s.r.x = choose(first + 8 < width, s.r.x, s.b.w);
  s.r.y = choose(first + 9 < width, s.r.y, s.r.x);
  s.r.z = choose(first + 10 < width, s.r.z, s.r.y);
  return s;
}

// Rows on their way down: the start values of two, the first sweep of two, the second sweep of two, the right side of two.
struct State {
  Sixteen above, here;
  Twelve once2, once1;
  Ten twice2, twice1;
  Twelve right2, right1;
};

// Takes the start values of row j + 1, sweeps row j once and row j - 1 twice, and gives the residual's sums of row j - 2.
vec4 advance(inout State t, Sixteen below, int j, int tx, int y0, int y1, Columns k) {
  int height = int(push.height), first = 8 * tx;
  below = with_ghosts(below, first);
  Twelve f = right_row(tx, j);
  Sixteen s = t.here, u = choose(j <= 0, s, t.above), d = choose(j >= height - 1, s, below);
  vec3 row = row_couplings(push, j);
  Twelve once;
  once.l = s.l.zw + push.step0 * (f.l - apply(k.l, row, s.l.zw, s.l.yz, vec2(s.l.w, s.a.x), u.l.zw, d.l.zw));
  once.a = s.a + push.step0 * (f.a - apply(k.a, row, s.a, vec4(s.l.w, s.a.xyz), vec4(s.a.yzw, s.b.x), u.a, d.a));
  once.b = s.b + push.step0 * (f.b - apply(k.b, row, s.b, vec4(s.a.w, s.b.xyz), vec4(s.b.yzw, s.r.x), u.b, d.b));
  once.r = s.r.xy + push.step0 * (f.r - apply(k.r, row, s.r.xy, vec2(s.b.w, s.r.x), s.r.yz, u.r.xy, d.r.xy));
  once = with_ghosts(once, first);

  int y = j - 1;
  Twelve c = t.once1, g = t.right1, up = choose(y <= 0, c, t.once2), down = choose(y >= height - 1, c, once);
  row = row_couplings(push, y);
  Ten z;
  z.l = c.l.y + push.step1 * (g.l.y - apply(k.l, row, c.l, vec2(c.l.x), vec2(c.a.x), up.l, down.l).y);
  z.a = c.a + push.step1 * (g.a - apply(k.a, row, c.a, vec4(c.l.y, c.a.xyz), vec4(c.a.yzw, c.b.x), up.a, down.a));
  z.b = c.b + push.step1 * (g.b - apply(k.b, row, c.b, vec4(c.a.w, c.b.xyz), vec4(c.b.yzw, c.r.x), up.b, down.b));
  z.r = c.r.x + push.step1 * (g.r.x - apply(k.r, row, c.r, vec2(c.b.w), vec2(c.r.y), up.r, down.r).x);
  z = with_ghosts(z, first);
  if (y >= y0 && y < y1) put(z, tx, y);

  vec4 sums = residual_sums(t.right2.a, t.right2.b, t.twice2, t.twice1, z, k, tx, j - 2);
  t = State(s, below, t.once1, once, t.twice1, z, t.right1, f);
  return sums;
}

void main() {
  uint tiles_y = (push.coarse_height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.coarse_pitch * tiles_y) return;
  int tx = int(tile % push.coarse_pitch), k0 = int(tile / push.coarse_pitch * push.rows), width = int(push.width);
  int height = int(push.height), coarse_height = int(push.coarse_height), first = 8 * tx;
  int y0 = 2 * k0, y1 = min(y0 + 2 * int(push.rows), height);
  Columns columns = columns_at(first);
  float edge = push.edge_width;
  Across w = Across(cubics(first - 4, width, edge), cubics(first - 3, width, edge), cubics(first + 4, width, edge),
                    cubics(first + 5, width, edge));

  // Two fine rows for each coarse row k. Their residuals come two and three rows later.
  int k = k0 - 2;
  Sixteen above2 = height_row(tx, k - 2, w), above = height_row(tx, k - 1, w), here = height_row(tx, k, w),
          below = height_row(tx, k + 1, w);
  const vec4 o = vec4(0.0);
  const Sixteen no_start = Sixteen(o, o, o, o);
  const Twelve no_row = Twelve(o.xy, o, o, o.xy);
  const Ten no_result = Ten(0.0, o, o, 0.0);
  State state = State(no_start, no_start, no_row, no_row, no_result, no_result, no_row, no_row);
  vec4 sums = vec4(0.0);
  for (int i = 0; i < int(push.rows) + 4; ++i, ++k) {
    Sixteen below2 = choose(k + 2 < coarse_height, height_row(tx, k + 2, w), onward(below, here));
    Sixteen upper = blend(cubic(2 * k, height, push.edge_height), above2, above, here, below);
    Sixteen lower = blend(cubic(2 * k + 1, height, push.edge_height), below2, below, here, above);
    sums += advance(state, upper, 2 * k - 1, tx, y0, y1, columns);
    int done = k - 2;
    if (done >= k0 && done < coarse_height && done < k0 + int(push.rows)) coarse[uint(done) * push.coarse_pitch + uint(tx)] = sums;
    sums = advance(state, lower, 2 * k, tx, y0, y1, columns);
    // Row -1 needs rows 0 and 1.
    above2 = choose(k == -1, onward(onward(below, below2), below), above);
    above = choose(k == -1, onward(below, below2), here);
    here = below;
    below = below2;
  }
}
