// Adds what the halved grid found: trilinear in the nodes' places, nothing where displacements are fixed.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/forward.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ForwardTransferPush push; };
TEXELS(0, vec4, coarse);
TEXELS(1, vec4, layers);   // of the fine grid
TEXELS(2, vec4, inverse);  // of the fine grid, for its free bits
TEXELS(3, vec4, before);
layout(binding = 4) writeonly buffer After { vec4 after[]; };

void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.fine_nodes) return;
  uint fine_rows = push.fine_plane / push.fine_row;
  uint i = node % push.fine_row, j = node / push.fine_row % fine_rows, k = node / push.fine_plane;
  int layer = int(k + kForwardSpareLayers);  // below the plane
  float over = texelFetch(layers, layer - 1).x, under = texelFetch(layers, layer).x;
  bool odd_x = (i & 1) != 0, odd_y = (j & 1) != 0, odd_z = (k & 1) != 0;
  float upper = odd_z ? under / (over + under) : 1.0;
  int dx = odd_x ? 1 : 0, dy = odd_y ? int(push.coarse_row) : 0, dz = odd_z ? int(push.coarse_plane) : 0;
  int c = int(push.coarse_lead + k / 2 * push.coarse_plane + j / 2 * push.coarse_row + i / 2);
  // Where dx, dy or dz is 0 both ends are the same node.
  vec3 top = 0.25 * ((texelFetch(coarse, c).xyz + texelFetch(coarse, c + dx).xyz) +
                     (texelFetch(coarse, c + dy).xyz + texelFetch(coarse, c + dy + dx).xyz));
  vec3 low = 0.25 * ((texelFetch(coarse, c + dz).xyz + texelFetch(coarse, c + dz + dx).xyz) +
                     (texelFetch(coarse, c + dz + dy).xyz + texelFetch(coarse, c + dz + dy + dx).xyz));
  vec3 sum = upper * top + (1.0 - upper) * low;
  uint free = uint(texelFetch(inverse, 2 * int(node)).w);
  int n = int(node + push.fine_lead);
  after[n] = texelFetch(before, n) +
             vec4((free & 1) != 0 ? sum.x : 0.0, (free & 2) != 0 ? sum.y : 0.0, (free & 4) != 0 ? sum.z : 0.0, 0.0);
}
