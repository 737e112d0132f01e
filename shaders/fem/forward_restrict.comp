// A residual to the halved grid: the transpose of what forward_prolong.comp does.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/forward.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ForwardTransferPush push; };
TEXELS(0, vec4, residual);
TEXELS(1, vec4, layers);          // of the fine grid
TEXELS(2, vec4, coarse_inverse);  // for its free bits
layout(binding = 3) writeonly buffer Right { vec4 right[]; };

int fine_row, fine_plane;
vec3 along_x(int n, float left, float after) {
  return texelFetch(residual, n).xyz + (left * texelFetch(residual, n - 1).xyz + after * texelFetch(residual, n + 1).xyz);
}
vec3 in_plane(int n, vec4 w) {
  return along_x(n, w.x, w.y) + (w.z * along_x(n - fine_row, w.x, w.y) + w.w * along_x(n + fine_row, w.x, w.y));
}

void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.coarse_nodes) return;
  fine_row = int(push.fine_row);
  fine_plane = int(push.fine_plane);
  uint coarse_rows = push.coarse_plane / push.coarse_row, coarse_planes = push.coarse_nodes / push.coarse_plane;
  uint i = node % push.coarse_row, j = node / push.coarse_row % coarse_rows, k = node / push.coarse_plane;
  // Neighbours outside weigh nothing.
  vec4 w = 0.5 * vec4(i > 0, i + 1 < push.coarse_row, j > 0, j + 1 < coarse_rows);
  int layer = int(2 * k + kForwardSpareLayers);  // below the plane
  float far_up = texelFetch(layers, layer - 2).x, up = texelFetch(layers, layer - 1).x;
  float down = texelFetch(layers, layer).x, far_down = texelFetch(layers, layer + 1).x;
  float above = k > 0 ? far_up / (far_up + up) : 0.0, below = k + 1 < coarse_planes ? far_down / (down + far_down) : 0.0;
  int n = int(push.fine_lead) + int(2 * k) * fine_plane + int(2 * j) * fine_row + int(2 * i);
  vec3 sum = in_plane(n, w) + (above * in_plane(n - fine_plane, w) + below * in_plane(n + fine_plane, w));
  uint free = uint(texelFetch(coarse_inverse, 2 * int(node)).w);
  right[node + push.coarse_lead] = vec4((free & 1) != 0 ? sum.x : 0.0, (free & 2) != 0 ? sum.y : 0.0, (free & 4) != 0 ? sum.z : 0.0, 0.0);
}
