// Takes a smooth map, given at the middles of cells of 4 x 4 px, off the heights; linear in between. One invocation owns a cell: it
// reads the nine around it once, and each of its four rows as one texel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/cell_change.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { CellChangePush push; };
TEXELS(0, float, levels);
TEXELS(1, vec4, heights);  // of the same memory: each is read before it is written, by the same invocation
layout(binding = 2) writeonly buffer Out { vec4 depth[]; };

// Of a row of cells, over the four pixels of the cell at x.
vec4 across(ivec3 columns, int row) {
  int first = row * int(push.cells_x);
  float left = texelFetch(levels, first + columns.x).x, here = texelFetch(levels, first + columns.y).x;
  float right = texelFetch(levels, first + columns.z).x;
  const vec4 to_left = vec4(0.375, 0.125, 0.0, 0.0), to_right = vec4(0.0, 0.0, 0.125, 0.375);
  return left * to_left + right * to_right + here * (1.0 - to_left - to_right);
}

void main() {
  if (gl_GlobalInvocationID.x >= push.cells_x * push.cells_y) return;
  int x = int(gl_GlobalInvocationID.x % push.cells_x), row = int(gl_GlobalInvocationID.x / push.cells_x);
  ivec3 columns = clamp(x + ivec3(-1, 0, 1), ivec3(0), ivec3(push.cells_x) - 1);
  ivec2 rows = clamp(row + ivec2(-1, 1), ivec2(0), ivec2(push.cells_y) - 1);
  vec4 above = across(columns, rows.x), here = across(columns, row), below = across(columns, rows.y);
  // Middles of cells lie at 1.5, 5.5, ... px.
  vec4 off[4] = {mix(here, above, 0.375), mix(here, above, 0.125), mix(here, below, 0.125), mix(here, below, 0.375)};
  for (int i = 0; i < 4; ++i) {
    int y = row * 4 + i, at = y * int(push.pitch) + x;
    if (y < int(push.height)) depth[at] = texelFetch(heights, at) - off[i];
  }
}
