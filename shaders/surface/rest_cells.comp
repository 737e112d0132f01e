// Mean height of each cell of 4 x 4 px: what the host finds the untouched pad's error from.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/cell_change.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { CellChangePush push; };
TEXELS(0, vec4, depth_texels);
layout(binding = 1) writeonly buffer Out { float means[]; };

void main() {
  uint cell = gl_GlobalInvocationID.x;
  if (cell >= push.cells_x * push.cells_y) return;
  uint x = cell % push.cells_x, y = cell / push.cells_x;
  bvec4 inside = lessThan(4 * x + uvec4(0, 1, 2, 3), uvec4(push.width));
  uint rows = min(kCellSide, push.height - y * kCellSide);
  vec4 sum = vec4(0.0);
  for (uint i = 0; i < rows; ++i) sum += texelFetch(depth_texels, int((y * kCellSide + i) * push.pitch + x));
  // Beyond the map's width a texel holds anything, NaN included.
  means[cell] = dot(mix(vec4(0.0), sum, inside), vec4(1.0)) / (dot(vec4(inside), vec4(1.0)) * float(rows));
}
