// Means of the filtered image over blocks of eight by eight pixels: what is left of the noise in them is small enough to tell in
// which direction the gray falls.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/slope.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { SlopePush push; };
TEXELS(0, uvec4, filtered_texels);  // eight 16-bit pixels to a texel
layout(binding = 1) writeonly buffer Blocks { float blocks[]; };

void main() {
  uint across = (push.width + 7) / 8, down = (push.height + 7) / 8;
  uint block = gl_GlobalInvocationID.x;
  if (block >= across * down) return;
  int bx = int(block % across), by = int(block / across);
  int first = 8 * bx, width = int(push.width), height = int(push.height);
  vec4 inside_a = vec4(lessThan(ivec4(0, 2, 4, 6) + first, ivec4(width)));
  vec4 inside_b = vec4(lessThan(ivec4(1, 3, 5, 7) + first, ivec4(width)));
  float sum = 0.0;
  for (int i = 0; i < 8; ++i) {
    int y = 8 * by + i;
    uvec4 w = texelFetch(filtered_texels, min(y, height - 1) * int(push.in_pitch) + bx);
    float row = dot(vec4(w & 0xffffu), inside_a) + dot(vec4(w >> 16), inside_b);
    sum += y < height ? row : 0.0;
  }
  blocks[block] = sum / float(min(width - first, 8) * min(height - 8 * by, 8));
}
