// Confidence of pixels as the weighted surface takes it: floats, 0 to 1. An invocation writes four.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/confidence.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ConfidencePush push; };
TEXELS(0, uvec2, map_pairs);
layout(binding = 1) writeonly buffer Weights { vec4 weights[]; };

void main() {
  uint pitch = (push.width + 3) / 4, texel = gl_GlobalInvocationID.x;
  if (texel >= pitch * push.height) return;
  uint x = texel % pitch, y = texel / pitch;
  uvec2 w = texelFetch(map_pairs, int(y * push.groups * 4 + x)).xy;
  weights[texel] = vec4(w.x & 255u, (w.x >> 16) & 255u, w.y & 255u, (w.y >> 16) & 255u) / float(kFullConfidence);
}
