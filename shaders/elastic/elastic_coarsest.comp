// The coarsest level, each cell's answer to each cell's pressure from a table of the distance between them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/elastic.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { ElasticCoarsestPush push; };
TEXELS(0, vec4, table_texels);  // row |dy|, columns dx from -4 * (push.table_pitch / 2)
TEXELS(1, vec4, pressure_texels);
layout(binding = 2) writeonly buffer Out { vec4 answer[]; };

void main() {
  const int reach = int(kElasticReach), margin = int(kElasticMargin);
  int columns = (int(push.width) + 3) / 4 + 2, rows = int(push.height) + 2 * reach;
  int cell = int(gl_GlobalInvocationID.x);
  if (cell >= columns * rows) return;
  int t = cell % columns, y = cell / columns;
  vec4 sum = vec4(0.0);
  for (int j = 0; j < rows; ++j) {
    int row = abs(y - j) * int(push.table_pitch) + int(push.table_pitch) / 2;
    int from = (j - reach + margin) * int(push.pitch) + 1;
    for (int i = 0; i < columns; ++i) {
      vec4 p = texelFetch(pressure_texels, from + i);
      vec4 below = texelFetch(table_texels, row + t - i - 1), above = texelFetch(table_texels, row + t - i);
      sum += p.x * above + p.y * vec4(below.w, above.xyz) + p.z * vec4(below.zw, above.xy) + p.w * vec4(below.yzw, above.x);
    }
  }
  answer[(y - reach + margin) * int(push.pitch) + 1 + t] = sum;
}
