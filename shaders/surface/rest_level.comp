// Mean and highest value of the height map in each tile of the contact stage. The host takes the rest level from tiles
// without contact and the deepest point from those with; of a tile that is neither touched nor at the border one row is enough.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/contact.h"
#include "shaders/shared/grid.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { RestLevelPush push; };
TEXELS(0, vec4, depth_texels);
layout(binding = 1) readonly buffer Contact { ContactRecord contact[]; };
layout(binding = 2) writeonly buffer Out { RestLevelRecord records[]; };

void main() {
  uint tile = gl_GlobalInvocationID.x;
  uint tiles = push.tiles_x * push.tiles_y;
  if (tile >= tiles) return;
  uint tile_x = tile % push.tiles_x, tile_y = tile / push.tiles_x;
  int t0 = int(tile_x * push.tile_texels), y0 = int(tile_y * push.tile_rows);
  bool border = tile_x == 0 || tile_y == 0 || tile_x + 1 == push.tiles_x || tile_y + 1 == push.tiles_y;
  int rows = border || contact[tile].area > 0 ? int(push.tile_rows) : 1, texels = int(push.tile_texels);
  int y1 = min(y0 + rows, int(push.height));
  vec4 sum = vec4(0.0), highest = vec4(-3.4e38);
  for (int t = 0; t < texels; ++t) {
    int texel = t0 + t;
    bvec4 inside = lessThan(ivec4(0, 1, 2, 3) + 4 * texel, ivec4(push.width));
    int column = min(texel, int(push.pitch) - 1);
    for (int y = y0; y < y1; ++y) {
      vec4 depth = texelFetch(depth_texels, y * int(push.pitch) + column);
      sum += mix(vec4(0.0), depth, inside);
      highest = max(highest, mix(vec4(-3.4e38), depth, inside));
    }
  }
  int columns = max(0, min(int(push.width) - 4 * t0, 4 * texels));
  RestLevelRecord record;
  record.mean = (sum.x + sum.y + sum.z + sum.w) / max(float(columns * (y1 - y0)), 1.0);
  record.highest = max(max(highest.x, highest.y), max(highest.z, highest.w));
  record.pixels = uint(columns * max(0, min(int(push.tile_rows), int(push.height) - y0)));
  records[tile] = record;
}
