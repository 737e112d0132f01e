// The filtered image to contact pressure, MPa: 0 below the threshold, else the inverse of the sensor's response. An invocation owns
// eight columns.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/elastic.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SATURATING = 0;
layout(push_constant) uniform Push { ElasticPressurePush push; };
TEXELS(0, uvec4, filtered_texels);  // eight 16-bit pixels to a texel
layout(binding = 1) writeonly buffer Out { vec4 pressure[]; };

vec4 pressure_of(vec4 gray, int first) {
  vec4 p = gray;
  if (SATURATING == 1) p = -push.limit * log(1.0 - min(gray, vec4(push.top)) / push.limit);
  p = mix(p * push.scale, vec4(0.0), lessThan(gray, vec4(push.threshold)));
  return mix(vec4(0.0), p, lessThan(ivec4(0, 1, 2, 3) + first, ivec4(push.width)));
}

void main() {
  uint across = (push.width + 7) / 8, strips = (push.height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= across * strips) return;
  int tx = int(tile % across), y0 = int(tile / across * push.rows), last = int(push.height) - 1;
  const int margin = int(kElasticMargin);
  for (int y = y0; y < y0 + int(push.rows); ++y) {
    uvec4 w = texelFetch(filtered_texels, min(y, last) * int(push.in_pitch) + tx);
    vec4 a = pressure_of(vec4(w.x & 0xffffu, w.x >> 16, w.y & 0xffffu, w.y >> 16), 8 * tx);
    vec4 b = pressure_of(vec4(w.z & 0xffffu, w.z >> 16, w.w & 0xffffu, w.w >> 16), 8 * tx + 4);
    if (y <= last) {
      int at = (y + margin) * int(push.pitch) + margin / 4 + 2 * tx;
      pressure[at] = a;
      pressure[at + 1] = b;
    }
  }
}
