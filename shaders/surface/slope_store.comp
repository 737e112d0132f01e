// The slopes themselves, where the weighted surface needs them at each pixel: p = d(depth)/dx and q = d(depth)/dy.
// An invocation owns eight columns and TILE_ROWS rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/slope.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { SlopePush push; };

#include "shaders/surface/slope_methods.glsl"

layout(binding = FIRST_OUTPUT) writeonly buffer Across { vec4 slope_x[]; };
layout(binding = FIRST_OUTPUT + 1) writeonly buffer Down { vec4 slope_y[]; };

void main() {
  uint tiles_x = (push.pitch + 1) / 2, tiles_y = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles_y) return;
  int tx = int(tile % tiles_x), y0 = int(tile / tiles_x * TILE_ROWS);
  bool wide = 2 * uint(tx) + 1 < push.pitch;
  Window window = window_at(tx, y0);
  Clipped clipped = none_clipped(y0);
  for (int y = y0; y < y0 + int(TILE_ROWS); ++y) {
    if (y % 8 == 0) window = window_at(tx, y);
    Slopes s = slopes_at(window, tx, y, clipped);
    uint texel = uint(y) * push.pitch + 2 * uint(tx);
    if (y < int(push.height)) {
      slope_x[texel] = vec4(s.p_a.zw, s.p_b.xy);
      slope_y[texel] = s.q_a;
      if (wide) {
        slope_x[texel + 1] = vec4(s.p_b.zw, s.p_c.xy);
        slope_y[texel + 1] = s.q_b;
      }
    }
  }
  store_clipped(clipped, tile, tx);
}
