// The way down of a cycle, in one pass over a level: two Chebyshev-Jacobi sweeps from zero, and what they leave of the right side,
// summed over blocks of two by two cells for the coarser level. Both need nothing but the right side.
// An invocation owns eight columns and streams down push.rows rows of the coarser level.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, vec4, right_texels);
TEXELS(1, vec2, right_pairs);
layout(binding = 2) writeonly buffer Out { vec4 result[]; };
layout(binding = 3) writeonly buffer Coarse { vec4 coarse[]; };

#include "shaders/frame/columns.glsl"
#include "shaders/surface/sweeps.glsl"

// Two sweeps from zero: the first is push.step0 times the right side.
vec4 sweep(vec4 f, vec4 l, vec4 r, vec4 u, vec4 d, Couplings k, vec3 row) {
  return push.step0 * f + push.step1 * (f - push.step0 * apply(k, row, f, l, r, u, d));
}
vec2 sweep(vec2 f, vec2 l, vec2 r, vec2 u, vec2 d, Beside k, vec3 row) {
  return push.step0 * f + push.step1 * (f - push.step0 * apply(k, row, f, l, r, u, d));
}

Ten solve_row(Twelve u, Twelve f, Twelve d, Columns k, int tx, int y) {
  vec3 row = row_couplings(push, y);
  Ten z;
  z.l = sweep(f.l, vec2(f.l.x), vec2(f.a.x), u.l, d.l, k.l, row).y;
  z.a = sweep(f.a, vec4(f.l.y, f.a.xyz), vec4(f.a.yzw, f.b.x), u.a, d.a, k.a, row);
  z.b = sweep(f.b, vec4(f.a.w, f.b.xyz), vec4(f.b.yzw, f.r.x), u.b, d.b, k.b, row);
  z.r = sweep(f.r, vec2(f.b.w), vec2(f.r.y), u.r, d.r, k.r, row).x;
  return with_ghosts(z, 8 * tx);
}

void main() {
  uint tiles_y = (push.coarse_height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.coarse_pitch * tiles_y) return;
  int tx = int(tile % push.coarse_pitch), k0 = int(tile / push.coarse_pitch * push.rows), y = 2 * k0;
  Columns columns = columns_at(8 * tx);
  Twelve f_before = right_row(tx, y - 1), f_here = right_row(tx, y), f_after = right_row(tx, y + 1);
  Ten above = solve_row(right_row(tx, y - 2), f_before, f_here, columns, tx, y - 1);
  Ten here = solve_row(f_before, f_here, f_after, columns, tx, y);
  for (int k = k0; k < k0 + int(push.rows); ++k, y += 2) {
    Twelve f_2 = right_row(tx, y + 2), f_3 = right_row(tx, y + 3);
    Ten below = solve_row(f_here, f_after, f_2, columns, tx, y + 1), next = solve_row(f_after, f_2, f_3, columns, tx, y + 2);
    put(here, tx, y);
    put(below, tx, y + 1);
    vec4 sum = residual_sums(f_here.a, f_here.b, above, here, below, columns, tx, y) +
               residual_sums(f_after.a, f_after.b, here, below, next, columns, tx, y + 1);
    if (k < int(push.coarse_height)) coarse[uint(k) * push.coarse_pitch + uint(tx)] = sum;
    above = below;
    here = next;
    f_here = f_2;
    f_after = f_3;
  }
}
