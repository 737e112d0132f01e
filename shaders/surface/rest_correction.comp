// Takes a smooth map, given at the middles of cells of 4 x 4 px, off the heights; linear in between.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/cell_change.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { CellChangePush push; };
layout(binding = 0) readonly buffer In { float levels[]; };
layout(binding = 1) buffer Out { vec4 depth[]; };

float level(int x, uint row) { return levels[row * push.cells_x + uint(clamp(x, 0, int(push.cells_x) - 1))]; }

void main() {
  uint texels = push.cells_x;  // of a row: a cell is as wide as a texel
  if (gl_GlobalInvocationID.x >= texels * push.height) return;
  uint x = gl_GlobalInvocationID.x % texels, y = gl_GlobalInvocationID.x / texels;
  // Middles of cells lie at 1.5, 5.5, ... px.
  float v = clamp((float(y) - 1.5) / 4.0, 0.0, float(push.cells_y - 1));
  uint above = uint(v), below = min(above + 1, push.cells_y - 1);
  float t = v - float(above);
  float left = mix(level(int(x) - 1, above), level(int(x) - 1, below), t);
  float here = mix(level(int(x), above), level(int(x), below), t);
  float right = mix(level(int(x) + 1, above), level(int(x) + 1, below), t);
  const vec4 to_left = vec4(0.375, 0.125, 0.0, 0.0), to_right = vec4(0.0, 0.0, 0.125, 0.375);
  uint at = y * push.pitch + x;
  depth[at] -= left * to_left + right * to_right + here * (1.0 - to_left - to_right);
}
