// Rows to their cosines and sines about the middle, four frequencies of several rows an invocation. Cells are added to and taken
// from their mirror images first: half the products. Only where there is contact, but for variant ALL_ROWS.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/traction.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint ROWS = 4;
layout(push_constant) uniform Push { TractionPush push; };
TEXELS(0, vec4, cells);
TEXELS(1, vec4, waves);  // for each cell of the left half: cosines, sines
layout(binding = 2) readonly buffer State { TractionState state; };
layout(binding = 3) writeonly buffer Out { vec4 mixed[]; };  // for each row: cosines, sines

void main() {
  uint i = gl_GlobalInvocationID.x;
  int pitch = int(push.pitch), wave = int(i) % pitch;
#ifdef ALL_ROWS
  int first = 0, y0 = int(i) / pitch * int(ROWS), end = int(push.rows);
#else
  int first = int(state.first_pair), y0 = (int(i) / pitch + int(state.first_row / ROWS)) * int(ROWS), end = int(state.end_row);
#endif
  if (y0 >= end) return;
  vec4 even[ROWS], odd[ROWS];
  for (int r = 0; r < int(ROWS); ++r) even[r] = odd[r] = vec4(0.0);
  for (int x = first; x < pitch / 2; ++x) {
    int at = 8 * x * pitch + wave;
    vec4 c0 = texelFetch(waves, at), s0 = texelFetch(waves, at + pitch);
    vec4 c1 = texelFetch(waves, at + 2 * pitch), s1 = texelFetch(waves, at + 3 * pitch);
    vec4 c2 = texelFetch(waves, at + 4 * pitch), s2 = texelFetch(waves, at + 5 * pitch);
    vec4 c3 = texelFetch(waves, at + 6 * pitch), s3 = texelFetch(waves, at + 7 * pitch);
    for (int r = 0; r < int(ROWS); ++r) {
      vec4 a = texelFetch(cells, (y0 + r) * pitch + x), b = texelFetch(cells, (y0 + r + 1) * pitch - 1 - x).wzyx;
      vec4 sum = a + b, difference = a - b;
      even[r] += sum.x * c0 + sum.y * c1 + sum.z * c2 + sum.w * c3;
      odd[r] += difference.x * s0 + difference.y * s1 + difference.z * s2 + difference.w * s3;
    }
  }
  for (int r = 0; r < int(ROWS); ++r) {
    mixed[2 * (y0 + r) * pitch + wave] = even[r];
    mixed[(2 * (y0 + r) + 1) * pitch + wave] = odd[r];
  }
}
