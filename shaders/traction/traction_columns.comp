// The layer's answer along columns, each wave along the rows by itself: what a column carries, weighed by a table of the
// distance. Four waves, their cosines and sines, of several rows an invocation. From the rows with contact to all, but for
// variant ALL_ROWS: from all to those with contact.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint ROWS = 8;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, vec4, mixed);
TEXELS(1, vec4, answers);  // distance from 1 - rows on, waves
layout(binding = 2) readonly buffer State { TractionState state; };
layout(binding = 3) writeonly buffer Out { vec4 answered[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  int pitch = int(push.pitch), wave = int(i) % pitch, y0 = int(i) / pitch * int(ROWS);
#ifdef ALL_ROWS
  int first = 0, end = int(push.height);
  y0 += int(state.first_row / ROWS * ROWS);
  if (y0 >= int(state.end_row)) return;
#else
  int first = int(state.first_row), end = int(state.end_row);
  if (y0 >= int(push.rows)) return;
#endif
  int middle = int(push.rows) - 1;
  vec4 even[ROWS], odd[ROWS], near[ROWS];
  for (int r = 0; r < int(ROWS); ++r) {
    even[r] = odd[r] = vec4(0.0);
    near[r] = texelFetch(answers, min(y0 + r - first + middle, 2 * middle) * pitch + wave);
  }
  for (int y = first; y < end; ++y) {
    vec4 c = texelFetch(mixed, 2 * y * pitch + wave), s = texelFetch(mixed, (2 * y + 1) * pitch + wave);
    for (int r = 0; r < int(ROWS); ++r) {
      even[r] += near[r] * c;
      odd[r] += near[r] * s;
    }
    for (int r = int(ROWS) - 1; r > 0; --r) near[r] = near[r - 1];
    near[0] = texelFetch(answers, max(y0 - y - 1 + middle, 0) * pitch + wave);
  }
  for (int r = 0; r < int(ROWS); ++r) {
    answered[2 * (y0 + r) * pitch + wave] = even[r];
    answered[(2 * (y0 + r) + 1) * pitch + wave] = odd[r];
  }
}
