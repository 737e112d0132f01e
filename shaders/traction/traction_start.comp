// A new frame: what there is to explain, and pressure to begin from, the last frame's. One workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint LANES = 64;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, vec4, sums);  // of the right side: squares, the largest
TEXELS(1, vec4, contact);
TEXELS(2, vec4, last);
layout(binding = 3) buffer State { TractionState state; };
layout(binding = 4) writeonly buffer Pressure { vec4 pressure[]; };
layout(binding = 5) writeonly buffer Groups { uint groups[]; };

#include "shaders/traction/one_workgroup.glsl"

// A cell without pressure enters only where a direction wants it; a trace in each lets them all begin.
const float kTrace_MPa = 1e-9;

// A frame that failed leaves no start for the next.
vec4 begin_from(uint i) {
  vec4 p = texelFetch(last, int(i));
  bvec4 finite = notEqual(floatBitsToUint(p) & 0x7f800000u, uvec4(0x7f800000u));
  return mix(vec4(0.0), max(p, vec4(0.0)), finite) * texelFetch(contact, int(i));
}

void set_groups(uint dispatch, uint invocations) {
  groups[3 * dispatch] = (invocations + push.workgroup - 1) / push.workgroup;
  groups[3 * dispatch + 1] = groups[3 * dispatch + 2] = 1;
}
uint blocks(uint rows, uint block) { return (rows + block - 1) / block; }

void main() {
  uint lane = gl_LocalInvocationID.x, texels = push.pitch * push.rows, count = push.pitch / 2 * (push.rows / push.row_block);
  vec2 right = vec2(0.0);
  for (uint i = lane; i < count; i += LANES) {
    vec2 part = texelFetch(sums, int(i)).xy;
    right = vec2(right.x + part.x, max(right.y, part.y));
  }
  right = over_lanes(right, true);
  float sum = 0.0, first = -float(push.rows), end = 0.0, pair = -0.5 * float(push.pitch);
  for (uint i = lane; i < texels; i += LANES) {
    vec4 p = begin_from(i);
    sum += p.x + p.y + p.z + p.w;
    bool some = any(greaterThan(texelFetch(contact, int(i)), vec4(0.0)));
    uint x = i % push.pitch, y = i / push.pitch;
    first = some ? max(first, -float(y)) : first;
    end = some ? max(end, float(y + 1)) : end;
    pair = some ? max(pair, -float(min(x, push.pitch - 1 - x))) : pair;
  }
  vec2 sum_and_end = over_lanes(vec2(sum, end), true);
  first = over_lanes(vec2(0.0, first), true).y;
  pair = over_lanes(vec2(0.0, pair), true).y;
  sum = sum_and_end.x;
  bool nothing = !(right.y > 0.0);
  for (uint i = lane; i < texels; i += LANES) {
    vec4 p = sum > 0.0 ? begin_from(i) : kTrace_MPa * texelFetch(contact, int(i));
    pressure[i] = nothing ? vec4(0.0) : p;
  }
  if (lane > 0) return;
  state.goal = nothing ? 0.0 : right.x;
  state.residual2 = state.squares = 0.0;
  state.entered = 1;
  state.iterations = state.converged = state.steps = 0;
  uint end_row = uint(sum_and_end.y), first_row = min(uint(-first), end_row), first_pair = uint(-pair);
  state.end_row = end_row;
  state.first_row = first_row;
  state.first_pair = first_pair;
  // Blocks begin where whole ones from the top would.
  uint wide = blocks(end_row, push.row_block) - first_row / push.row_block;
  uint high = blocks(end_row, push.column_block) - first_row / push.column_block;
  uint all_wide = push.rows / push.row_block, all_high = push.rows / push.column_block;
  state.parts = (push.pitch / 2 - first_pair) * wide;
  set_groups(kTractionScalars, 1);
  set_groups(kTractionMovedRows, push.pitch * wide);
  set_groups(kTractionMovedColumns, push.pitch * all_high);
  set_groups(kTractionMovedBack, push.pitch / 2 * all_wide);
  set_groups(kTractionFreshRows, push.pitch * wide);
  set_groups(kTractionFreshColumns, push.pitch * all_high);
  set_groups(kTractionFreshBack, push.pitch / 2 * all_wide);
  set_groups(kTractionLaplacian, push.pitch * push.rows);
  set_groups(kTractionGradientRows, push.pitch * all_wide);
  set_groups(kTractionGradientColumns, push.pitch * high);
  set_groups(kTractionGradientBack, (push.pitch / 2 - first_pair) * wide);
}
