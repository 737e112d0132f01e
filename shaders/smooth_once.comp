// The finest level of the full-multigrid pass: the coarse solution interpolated, then one Jacobi sweep. Nothing is computed from it
// but the answer, so what a second sweep would gain is not worth a third of the frame's time.
// An invocation owns four columns and streams down push.rows rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
layout(binding = 0) uniform samplerBuffer right_texels;
layout(binding = 1) uniform samplerBuffer coarse_pairs;
layout(binding = 2) writeonly buffer Out { vec4 result[]; };

#include "shaders/coarse_row.glsl"

// The finest level's cells are all of one size: every coupling is 1.
void sweep(Eight above, Eight here, Eight below, int y, int y1, int tx) {
  int last = int(push.height) - 1;
  vec4 f = texelFetch(right_texels, min(y, last) * int(push.pitch) + tx);
  vec4 c = mid(here);
  vec4 u = y == 0 ? c : mid(above), d = y == last ? c : mid(below);
  vec4 l = vec4(here.a.yzw, here.b.x), r = vec4(here.a.w, here.b.xyz);
  if (y < y1) result[uint(y) * push.pitch + uint(tx)] = c + push.step0 * (f + l + r + u + d - 4.0 * c);
}

void main() {
  uint tiles_y = (push.height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.pitch * tiles_y) return;
  int tx = int(tile % push.pitch);
  int y0 = int(tile / push.pitch * push.rows);
  int first = 4 * tx, width = int(push.width), height = int(push.height);
  int y1 = min(y0 + int(push.rows), height);
  Eight far = far_weights(push, first);

  // Two fine rows, upper and lower, for each coarse row k.
  int k = y0 / 2;
  Eight before = coarse_row(tx, k - 1, far), here = coarse_row(tx, k, far);
  Eight above = with_ghosts(blend(before, here, far_weight(y0 - 1, height, push.edge_height)), first, width);
  Eight upper = with_ghosts(blend(here, before, far_weight(y0, height, push.edge_height)), first, width);
  for (int y = y0; y < y0 + int(push.rows); y += 2, ++k) {
    Eight after = coarse_row(tx, k + 1, far);
    Eight lower = with_ghosts(blend(here, after, far_weight(y + 1, height, push.edge_height)), first, width);
    Eight next = with_ghosts(blend(after, here, far_weight(y + 2, height, push.edge_height)), first, width);
    sweep(above, upper, lower, y, y1, tx);
    sweep(upper, lower, next, y + 1, y1, tx);
    here = after;
    above = lower;
    upper = next;
  }
}
