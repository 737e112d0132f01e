// Conjugate gradients' vectors in double precision. DIRECTION: p = scale z + beta p. ADVANCE: u += alpha p, r -= alpha q, and the
// sums of the squares of r. NARROW and ADVANCE: r over scale in single precision, for the cycle.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/forward.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint NODES_EACH = 8;
layout(push_constant) uniform Push { ForwardNodesPush push; };
layout(binding = 0) readonly buffer Scalars { ForwardScalars scalars; };
#ifdef DIRECTION
TEXELS(1, vec4, correction);
TEXELS(2, uvec4, direction);
layout(binding = 3) writeonly buffer Direction { uvec4 next_direction[]; };
#else
TEXELS(1, uvec4, residual);
layout(binding = 2) writeonly buffer Right { vec4 right[]; };
#ifdef ADVANCE
TEXELS(3, uvec4, direction);
TEXELS(4, uvec4, product);
TEXELS(5, uvec4, displacement);
layout(binding = 6) writeonly buffer Residual { uvec4 next_residual[]; };
layout(binding = 7) writeonly buffer Displacement { uvec4 next_displacement[]; };
layout(binding = 8) writeonly buffer Sums { uvec4 sums[]; };
#endif
#endif

#include "shaders/fem/wide_vector.glsl"
uvec4 first_texel(dvec3 v) { return uvec4(unpackDouble2x32(v.x), unpackDouble2x32(v.y)); }
uvec4 second_texel(dvec3 v) { return uvec4(unpackDouble2x32(v.z), 0, 0); }

void main() {
  uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
  double scale = scalars.scale;
#ifdef DIRECTION
  double beta = scalars.beta;
#else
  double narrow = scale > 0.0lf ? 1.0lf / scale : 0.0lf;
#ifdef ADVANCE
  double alpha = scalars.alpha, sum = 0.0lf;
#endif
#endif
  for (uint each = 0; each < NODES_EACH; ++each) {
    uint node = gl_GlobalInvocationID.x + each * stride;
    if (node < push.nodes) {
      int n = int(node + push.lead);
#ifdef DIRECTION
      dvec3 p = scale * dvec3(texelFetch(correction, n).xyz) + beta * wide_at(direction, n);
      next_direction[2 * n] = first_texel(p);
      next_direction[2 * n + 1] = second_texel(p);
#else
      dvec3 r = wide_at(residual, n);
#ifdef ADVANCE
      r -= alpha * wide_at(product, n);
      dvec3 u = wide_at(displacement, n) + alpha * wide_at(direction, n);
      next_residual[2 * n] = first_texel(r);
      next_residual[2 * n + 1] = second_texel(r);
      next_displacement[2 * n] = first_texel(u);
      next_displacement[2 * n + 1] = second_texel(u);
      sum += dot(r, r);
#endif
      right[n] = vec4(narrow * r, 0.0);
#endif
    }
  }
#ifdef ADVANCE
  sums[gl_GlobalInvocationID.x] = uvec4(unpackDouble2x32(sum), 0, 0);
#endif
}
