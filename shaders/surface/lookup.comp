// The filtered change to depth, by a table with an entry for each value that a stored pixel can have. An invocation owns eight
// columns.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/lookup.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { LookupPush push; };
TEXELS(0, uvec4, filtered_texels);  // eight 16-bit pixels to a texel
TEXELS(1, float, depths);           // mm
layout(binding = 2) writeonly buffer Out { vec4 depth[]; };

float depth_of(uint stored) { return texelFetch(depths, int(stored)).x; }

vec4 depths_of(uvec2 w, int first) {
  vec4 d = vec4(depth_of(w.x & 0xffffu), depth_of(w.x >> 16), depth_of(w.y & 0xffffu), depth_of(w.y >> 16));
  return mix(vec4(0.0), d, lessThan(ivec4(0, 1, 2, 3) + first, ivec4(push.width)));
}

void main() {
  uint across = (push.width + 7) / 8, strips = (push.height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= across * strips) return;
  int tx = int(tile % across), y0 = int(tile / across * push.rows), last = int(push.height) - 1;
  bool wide = 2 * uint(tx) + 1 < push.pitch;
  for (int y = y0; y < y0 + int(push.rows); ++y) {
    uvec4 w = texelFetch(filtered_texels, min(y, last) * int(push.in_pitch) + tx);
    vec4 a = depths_of(w.xy, 8 * tx), b = depths_of(w.zw, 8 * tx + 4);
    if (y <= last) {
      uint at = uint(y) * push.pitch + 2 * uint(tx);
      depth[at] = a;
      if (wide) depth[at + 1] = b;
    }
  }
}
