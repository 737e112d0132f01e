// Single precision products. STEP: one smoothing step, r = right - K x, d = keep d + gain B r, x' = x + d; with DOT also the
// sums of right times x'. Else: right - K x where displacements are free.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/forward.h"
#include "shaders/shared/texels.glsl"
#include "shaders/fem/forward_product.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 4) const bool KEEP = true;  // false: the first step from here, the last one counts for nothing
layout(constant_id = 5) const bool GOES_ON = true;  // another step comes: store d
TEXELS(3, vec4, right);
TEXELS(4, vec4, inverse);  // xx, yy, zz, free bits; xy, xz, yz, spare
#ifdef STEP
TEXELS(5, vec4, last_step);
layout(binding = 6) writeonly buffer Step { vec4 next_step[]; };
layout(binding = 7) writeonly buffer Next { vec4 next[]; };
#ifdef DOT
layout(binding = 8) writeonly buffer Sums { uvec4 sums[]; };
double sum = 0.0;
#endif
#else
layout(binding = 5) writeonly buffer Residual { vec4 residual[]; };
#endif

void finish(int n, vec3 x, vec3 f) {
  int node = n - int(push.lead);
  vec3 b = texelFetch(right, n).xyz, r = b - f;
  vec4 own = texelFetch(inverse, 2 * node), mixed = texelFetch(inverse, 2 * node + 1);
#ifdef STEP
  vec3 d = push.gain * (own.xyz * r + mixed.xxy * r.yxx + mixed.yzz * r.zzy);
  if (KEEP) d += push.keep * texelFetch(last_step, n).xyz;
  if (GOES_ON) next_step[n] = vec4(d, 0.0);
  next[n] = vec4(x + d, 0.0);
#ifdef DOT
  sum += double(dot(b, x + d));
#endif
#else
  uint free = uint(own.w);
  residual[n] = vec4((free & 1) != 0 ? r.x : 0.0, (free & 2) != 0 ? r.y : 0.0, (free & 4) != 0 ? r.z : 0.0, 0.0);
#endif
}

void main() {
  march();
#ifdef DOT
  if (owns_column())
    sums[sums_place()] = uvec4(unpackDouble2x32(sum), 0, 0);
#endif
}
