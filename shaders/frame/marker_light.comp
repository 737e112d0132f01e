// The largest (LARGEST), or the smallest, light of the blocks around: one after the other they close what is darker and small.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/markers.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint LARGEST = 1;
TEXELS(0, uint, light);
layout(binding = 1) writeonly buffer Closed { uint closed[]; };
layout(push_constant) uniform Push { MarkersPush push; };

#include "shaders/frame/markers_masks.glsl"

void main() {
  uint block = gl_GlobalInvocationID.x;
  if (block >= push.blocks_x * push.blocks_y) return;
  ivec2 at = ivec2(block % push.blocks_x, block / push.blocks_x), last = ivec2(push.blocks_x, push.blocks_y) - 1;
  int reach = int(push.closing);
  uvec3 found = unpack_cell(texelFetch(light, int(block)).x);
  for (int j = -reach; j <= reach; ++j)
    for (int i = -reach; i <= reach; ++i) {
      ivec2 near = clamp(at + ivec2(i, j), ivec2(0), last);
      uvec3 v = unpack_cell(texelFetch(light, near.y * int(push.blocks_x) + near.x).x);
      found = LARGEST == 1 ? max(found, v) : min(found, v);
    }
  closed[block] = pack_cell(found);
}
