// The first smoothing step from zero: d = gain B right, x = d.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/forward.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ForwardNodesPush push; };
TEXELS(0, vec4, right);
TEXELS(1, vec4, inverse);
layout(binding = 2) writeonly buffer Step { vec4 next_step[]; };
layout(binding = 3) writeonly buffer Next { vec4 next[]; };

void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.nodes) return;
  int n = int(node + push.lead);
  vec3 r = texelFetch(right, n).xyz;
  vec4 own = texelFetch(inverse, 2 * int(node)), mixed = texelFetch(inverse, 2 * int(node) + 1);
  vec4 d = vec4(push.gain * (own.xyz * r + mixed.xxy * r.yxx + mixed.yzz * r.zzy), 0.0);
  next_step[n] = d;
  next[n] = d;
}
