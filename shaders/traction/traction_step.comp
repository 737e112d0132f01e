// How far along the direction, from the depth that it makes; pressure goes there, is cut where it would pull, and comes back where
// the gradient wants it. One workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint LANES = 64;
layout(push_constant) uniform Push { TractionPush push; };
layout(binding = 0) uniform samplerBuffer depth;  // of the direction
layout(binding = 1) uniform samplerBuffer known;
layout(binding = 2) uniform samplerBuffer direction;
layout(binding = 3) uniform samplerBuffer gradient;
layout(binding = 4) uniform samplerBuffer contact;
layout(binding = 5) uniform samplerBuffer last;
layout(binding = 6) buffer State { TractionState state; };
layout(binding = 7) writeonly buffer Pressure { vec4 pressure[]; };

#include "shaders/traction/edges.glsl"
#include "shaders/traction/one_workgroup.glsl"

void main() {
  uint lane = gl_LocalInvocationID.x, texels = state.moves != 0 ? push.pitch * push.rows : 0;
  vec2 sums = vec2(0.0);  // along the gradient, curvature
  for (uint i = lane; i < texels; i += LANES) {
    uint x = i % push.pitch, y = i / push.pitch;
    Around of = around(depth, x, y), sees = around(known, x, y);
    vec4 right = of.right - of.here, down = of.down - of.here;
    vec4 slopes2 = sees.here * (sees.right * right * right + sees.down * down * down);
    vec4 along = texelFetch(direction, int(i));
    // Beside the contact the gradient's memory may hold anything.
    vec4 falls = mix(vec4(0.0), texelFetch(gradient, int(i)), greaterThan(along * along, vec4(0.0)));
    sums += vec2(dot(along, falls), push.per_cell2 * dot(slopes2, vec4(1.0)) + push.prior * dot(along, along));
  }
  sums = over_lanes(sums, false);
  float step = sums.y > 0.0 ? sums.x / sums.y : 0.0, into = step > 0.0 ? step : push.first_step;
  bool entered = false;
  for (uint i = lane; i < texels; i += LANES) {
    vec4 p = max(texelFetch(last, int(i)) + step * texelFetch(direction, int(i)), vec4(0.0));
    vec4 wanted = mix(vec4(0.0), into * texelFetch(gradient, int(i)), greaterThan(texelFetch(contact, int(i)), vec4(0.0)));
    bvec4 enters = bvec4(uvec4(equal(p, vec4(0.0))) * uvec4(greaterThan(wanted, vec4(0.0))));
    pressure[i] = mix(p, wanted, enters);
    entered = entered || any(enters);
  }
  if (entered) atomicOr(state.entered, 1u);
}
