// How far along the direction, from the depth that it makes; pressure goes there, is cut where it would pull, and comes back
// where the gradient wants it. Where nothing is cut or comes back the depth that pressure explains changes by the direction's,
// and need not be computed afresh. One workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint LANES = 64;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, vec4, depth);  // of the direction
TEXELS(1, vec4, known);
TEXELS(2, vec4, direction);
TEXELS(3, vec4, gradient);
TEXELS(4, vec4, contact);
TEXELS(5, vec4, last);
layout(binding = 6) buffer State { TractionState state; };
layout(binding = 7) writeonly buffer Pressure { vec4 pressure[]; };
TEXELS(8, vec4, unexplained);
layout(binding = 9) writeonly buffer Unexplained { vec4 next_unexplained[]; };
layout(binding = 10) buffer Groups { uint groups[]; };

const uint kMostSteps = 16;  // after which rounding is swept out

#include "shaders/traction/edges.glsl"
#include "shaders/traction/one_workgroup.glsl"

void main() {
  uint lane = gl_LocalInvocationID.x, texels = push.pitch * push.rows;
  vec2 sums = vec2(0.0);  // along the gradient, curvature
  for (uint i = lane; i < texels; i += LANES) {
    uint x = i % push.pitch, y = i / push.pitch;
    Around of = around_at(depth, x, y), sees = around_at(known, x, y);
    vec4 right = of.right - of.here, down = of.down - of.here;
    vec4 slopes2 = sees.here * (sees.right * right * right + sees.down * down * down);
    vec4 along = texelFetch(direction, int(i));
    // Outside the contact the gradient's memory may hold anything.
    vec4 falls = mix(vec4(0.0), texelFetch(gradient, int(i)), greaterThan(along * along, vec4(0.0)));
    sums += vec2(dot(along, falls), push.per_cell2 * dot(slopes2, vec4(1.0)) + push.prior * dot(along, along));
  }
  sums = over_lanes(sums, false);
  float step = sums.y > 0.0 ? sums.x / sums.y : 0.0, into = step > 0.0 ? step : push.first_step;
  vec2 changes = vec2(0.0);  // cells that are cut, that enter
  for (uint i = lane; i < texels; i += LANES) {
    vec4 along = texelFetch(direction, int(i)), p = texelFetch(last, int(i)) + step * along;
    vec4 wanted = mix(vec4(0.0), into * texelFetch(gradient, int(i)), greaterThan(texelFetch(contact, int(i)), vec4(0.0)));
    vec4 gone = vec4(lessThanEqual(p, vec4(0.0))), enters = gone * vec4(greaterThan(wanted, vec4(0.0)));
    pressure[i] = mix(max(p, vec4(0.0)), wanted, greaterThan(enters, vec4(0.0)));
    changes += vec2(dot(gone, vec4(notEqual(along, vec4(0.0)))), dot(enters, vec4(1.0)));
  }
  uint steps = state.steps + 1;
  changes = over_lanes(changes, false);
  bool fresh = changes.x + changes.y > 0.0 || steps > kMostSteps;
  for (uint i = lane; i < (fresh ? 0 : texels); i += LANES)
    next_unexplained[i] = texelFetch(unexplained, int(i)) - step * texelFetch(depth, int(i));
  if (lane > 0) return;
  state.entered = changes.y > 0.0 ? 1 : 0;
  state.steps = fresh ? 0 : steps;
  for (uint i = 0; i < 3; ++i) groups[3 * (kTractionFreshRows + i)] = fresh ? groups[3 * (kTractionMovedRows + i)] : 0;
}
