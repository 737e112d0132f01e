// The last residual, the pressure as the host reads it, and parts of its sums. One workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint LANES = 64;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, vec4, sums);
TEXELS(1, vec4, pressure);
TEXELS(2, vec4, unexplained);
TEXELS(3, vec4, known);
layout(binding = 4) readonly buffer State { TractionState state; };
layout(binding = 5) writeonly buffer Out { float cells[]; };  // height x width
layout(binding = 6) writeonly buffer Result { TractionState result; };
layout(binding = 7) writeonly buffer Records { TractionRecord records[]; };

#include "shaders/traction/edges.glsl"
#include "shaders/traction/one_workgroup.glsl"

void main() {
  uint lane = gl_LocalInvocationID.x, texels = push.pitch * push.rows, count = state.parts;
  vec2 squares = vec2(0.0);
  for (uint i = lane; i < count; i += LANES) squares += texelFetch(sums, int(i)).xy;
  squares = over_lanes(squares, false);
  TractionRecord r = TractionRecord(0.0, 0.0, 0.0, 0.0, 0, 0);
  for (uint i = lane; i < texels; i += LANES) {
    uint x = i % push.pitch, y = i / push.pitch;
    vec4 p = texelFetch(pressure, int(i));
    vec4 along = (4.0 * float(x) + vec4(0.5, 1.5, 2.5, 3.5) - 0.5 * float(push.width)) * push.cell_mm;
    float down = (float(y) + 0.5 - 0.5 * float(push.height)) * push.cell_mm, sum = dot(p, vec4(1.0));
    r.pressure += sum;
    r.pressure_x += dot(p, along);
    r.pressure_y += down * sum;
    bool edge = y == 0 || y + 1 == push.height;
    for (uint j = 0; j < 4; ++j) {
      uint column = 4 * x + j;
      if (column < push.width && y < push.height) cells[y * push.width + column] = p[j];
      r.border += p[j] > 0.0 && (edge || column == 0 || column + 1 == push.width) ? 1 : 0;
    }
    Around of = around_at(unexplained, x, y), sees = around_at(known, x, y);
    vec4 to_right = of.right - of.here, to_down = of.down - of.here;
    vec4 right = sees.here * sees.right, below = sees.here * sees.down;
    r.slopes2 += push.per_cell2 * (dot(right, to_right * to_right) + dot(below, to_down * to_down));
    r.edges += uint(dot(right + below, vec4(1.0)));
  }
  records[lane] = r;
  if (lane > 0) return;
  // Where nothing moved any more the sums are those that ended it.
  result = state;
  float left = state.goal > 0.0 ? squares.x + squares.y : 0.0;
  result.residual2 = left;
  result.converged = state.converged != 0 || left <= push.tolerance * push.tolerance * state.goal ? 1 : 0;
}
