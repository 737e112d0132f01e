// The coarsest level, solved directly: the pseudo-inverse of A, made on the host, times the right side.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/grid.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { CoarsestPush push; };
TEXELS(0, vec4, inverse_texels);  // row j: what right side j adds to every cell
TEXELS(1, vec4, right_texels);
layout(binding = 2) writeonly buffer Out { vec4 result[]; };

void main() {
  int texel = int(gl_GlobalInvocationID.x);
  int texels = int(push.texels);
  if (texel >= texels) return;
  vec4 sum = vec4(0.0);
  for (int j = 0; j < texels; ++j) {
    vec4 f = texelFetch(right_texels, j);
    int at = 4 * j * texels + texel;
    sum += f.x * texelFetch(inverse_texels, at) + f.y * texelFetch(inverse_texels, at + texels) +
           f.z * texelFetch(inverse_texels, at + 2 * texels) + f.w * texelFetch(inverse_texels, at + 3 * texels);
  }
  result[texel] = sum;
}
