// The coarsest grid's solution: its dense inverse times the right side, a row of three by nodes of texels for each component.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/forward.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ForwardNodesPush push; };
TEXELS(0, vec4, right);
TEXELS(1, vec4, dense);  // column of node m, component, row: m * 3 * nodes + component * nodes + row
layout(binding = 2) writeonly buffer Solution { vec4 solution[]; };

void main() {
  int node = int(gl_GlobalInvocationID.x), nodes = int(push.nodes);
  if (node >= nodes) return;
  vec3 sum = vec3(0.0);
  for (int m = 0; m < nodes; ++m) {
    vec3 r = texelFetch(right, m + int(push.lead)).xyz;
    int at = m * 3 * nodes + node;
    sum += vec3(dot(texelFetch(dense, at).xyz, r), dot(texelFetch(dense, at + nodes).xyz, r), dot(texelFetch(dense, at + 2 * nodes).xyz, r));
  }
  solution[node + int(push.lead)] = vec4(sum, 0.0);
}
