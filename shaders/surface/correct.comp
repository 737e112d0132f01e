// Adds the interpolated coarse correction to a level's solution.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, vec2, coarse_pairs);
TEXELS(1, vec4, present_texels);
layout(binding = 2) writeonly buffer Out { vec4 result[]; };

#include "shaders/surface/coarse_row.glsl"

void main() {
  uint tiles_y = (push.height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.pitch * tiles_y) return;
  int tx = int(tile % push.pitch);
  int y0 = int(tile / push.pitch * push.rows);
  int k = y0 / 2, height = int(push.height);
  Eight far = far_weights(push, 4 * tx);
  vec4 before = mid(coarse_row(tx, k - 1, far)), here = mid(coarse_row(tx, k, far));
  for (int y = y0; y < y0 + int(push.rows); y += 2, ++k) {
    vec4 after = mid(coarse_row(tx, k + 1, far));
    int last = height - 1;
    vec4 upper = texelFetch(present_texels, min(y, last) * int(push.pitch) + tx);
    vec4 lower = texelFetch(present_texels, min(y + 1, last) * int(push.pitch) + tx);
    if (y <= last) result[uint(y) * push.pitch + uint(tx)] =
        upper + mix(here, before, far_weight(y, height, push.edge_height));
    if (y + 1 <= last) result[uint(y + 1) * push.pitch + uint(tx)] =
        lower + mix(here, after, far_weight(y + 1, height, push.edge_height));
    before = here;
    here = after;
  }
}
