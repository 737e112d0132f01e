// Minus the divergence of a map's gradient over the edges between known cells.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, vec4, map);
TEXELS(1, vec4, known);
layout(binding = 2) writeonly buffer Out { vec4 laplacian[]; };

#include "shaders/traction/edges.glsl"

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.pitch * push.rows) return;
  Around of = around_at(map, i % push.pitch, i / push.pitch), sees = around_at(known, i % push.pitch, i / push.pitch);
  vec4 sum = sees.left * (of.here - of.left) + sees.right * (of.here - of.right);
  sum += sees.up * (of.here - of.up) + sees.down * (of.here - of.down);
  laplacian[i] = sees.here * sum * push.per_cell2;
}
