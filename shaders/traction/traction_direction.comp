// The next direction: the gradient where there is pressure, and what stays of the last direction. Where the gradient that is left
// is small enough nothing moves any more. One workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint LANES = 64;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, vec4, sums);  // squares of the gradient: with pressure, without
TEXELS(1, vec4, gradient);
TEXELS(2, vec4, pressure);
TEXELS(3, vec4, last);
layout(binding = 4) buffer State { TractionState state; };
layout(binding = 5) writeonly buffer Direction { vec4 direction[]; };
layout(binding = 6) writeonly buffer Groups { uint groups[]; };

#include "shaders/traction/one_workgroup.glsl"

void main() {
  uint lane = gl_LocalInvocationID.x, texels = push.pitch * push.rows, count = state.parts;
  vec2 squares = vec2(0.0);
  for (uint i = lane; i < count; i += LANES) squares += texelFetch(sums, int(i)).xy;
  float before = state.squares, goal = state.goal;
  bool follows = state.entered == 0;
  squares = over_lanes(squares, false);
  // Said so that what is not a number is not converged.
  bool done = squares.x + squares.y <= push.tolerance * push.tolerance * goal || !(goal > 0.0);
  float keep = follows && before > 0.0 ? squares.x / before : 0.0;
  for (uint i = lane; i < (done ? 0 : texels); i += LANES) {
    vec4 along = texelFetch(gradient, int(i));
    // Without a last direction its memory may hold anything.
    if (keep > 0.0) along += keep * texelFetch(last, int(i));
    direction[i] = mix(vec4(0.0), along, greaterThan(texelFetch(pressure, int(i)), vec4(0.0)));
  }
  if (lane > 0) return;
  state.squares = squares.x;
  state.entered = 0;
  state.iterations += done ? 0 : 1;
  state.converged = done ? 1 : 0;
  if (!done) return;
  for (uint i = 0; i < kTractionDispatches; ++i) groups[3 * i] = 0;
}
