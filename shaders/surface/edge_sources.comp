// Sources on the edge of what is known: the matrix times what flows through missing faces, added to the right side.
// An invocation owns four cells.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/grid.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { EdgePush push; };
TEXELS(0, uint, cells);
TEXELS(1, vec4, matrix);  // four rows to a texel, column by column
TEXELS(2, float, residual);
layout(binding = 3) buffer Sources { vec4 sources[]; };
layout(binding = 4) buffer Right { float right_side[]; };

void main() {
  uint group = gl_GlobalInvocationID.x;
  if (group >= push.groups) return;
  vec4 sum = vec4(0.0);
  for (uint column = 0; column < push.cells; ++column)
    sum += texelFetch(matrix, int(column * push.groups + group)) * texelFetch(residual, int(column)).x;
  sources[group] = sum + (push.first != 0 ? vec4(0.0) : sources[group]);
  for (uint i = 0; i < 4; ++i) {
    uint cell = 4 * group + i;
    if (cell < push.cells) right_side[texelFetch(cells, int(cell)).x] += sum[i];
  }
}
