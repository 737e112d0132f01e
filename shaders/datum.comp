// Sum, lowest and highest value of the height map in each tile of the contact stage. The host takes the rest level from tiles
// without contact.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/grid.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { DatumPush push; };
layout(binding = 0) uniform samplerBuffer depth_texels;
layout(binding = 1) writeonly buffer Out { DatumRecord records[]; };

void main() {
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles_x * push.tiles_y) return;
  int t0 = int(tile % push.tiles_x * push.tile_texels);
  int y0 = int(tile / push.tiles_x * push.tile_rows);
  int y1 = min(y0 + int(push.tile_rows), int(push.height));
  vec4 sum = vec4(0.0), lowest = vec4(3.4e38), highest = vec4(-3.4e38);
  for (uint t = 0; t < push.tile_texels; ++t) {
    int texel = t0 + int(t);
    bvec4 inside = lessThan(ivec4(0, 1, 2, 3) + 4 * texel, ivec4(push.width));
    int column = min(texel, int(push.pitch) - 1);
    for (int y = y0; y < y1; ++y) {
      vec4 depth = texelFetch(depth_texels, y * int(push.pitch) + column);
      sum += mix(vec4(0.0), depth, inside);
      lowest = min(lowest, mix(vec4(3.4e38), depth, inside));
      highest = max(highest, mix(vec4(-3.4e38), depth, inside));
    }
  }
  DatumRecord record;
  record.sum = sum.x + sum.y + sum.z + sum.w;
  record.lowest = min(min(lowest.x, lowest.y), min(lowest.z, lowest.w));
  record.highest = max(max(highest.x, highest.y), max(highest.z, highest.w));
  record.pixels = uint(max(0, min(int(push.width) - 4 * t0, int(4 * push.tile_texels)))) * uint(max(0, y1 - y0));
  records[tile] = record;
}
