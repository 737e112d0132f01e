// Right sides of the next two coarser levels: sums over blocks of two by two cells (the fluxes' sum, so they stay compatible), and
// the sums of those.
// An invocation owns four cells of the coarsest row and streams down push.rows rows of it.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, vec4, right_texels);
layout(binding = 1) writeonly buffer Coarse { vec4 coarse[]; };
layout(binding = 2) writeonly buffer Coarser { vec4 coarser[]; };

vec4 inside(vec4 v, int first) {
  return mix(vec4(0.0), v, lessThan(ivec4(0, 1, 2, 3) + first, ivec4(push.width)));
}

// A texel of the coarser level's row k.
vec4 block_sums(int tx, int k) {
  vec4 sum = vec4(0.0);
  int last = int(push.pitch) - 1;
  for (int i = 0; i < 2; ++i) {
    int y = 2 * k + i, row = min(y, int(push.height) - 1) * int(push.pitch);
    vec4 a = inside(texelFetch(right_texels, row + min(2 * tx, last)), 8 * tx);
    vec4 b = inside(texelFetch(right_texels, row + min(2 * tx + 1, last)), 8 * tx + 4);
    sum += y < int(push.height) ? vec4(a.xz + a.yw, b.xz + b.yw) : vec4(0.0);
  }
  return sum;
}

void main() {
  uint width = (push.coarse_pitch + 1) / 2, height = (push.coarse_height + 1) / 2;
  uint tiles_y = (height + push.rows - 1) / push.rows, tile = gl_GlobalInvocationID.x;
  if (tile >= width * tiles_y) return;
  uint tx = tile % width, k0 = tile / width * push.rows;
  for (uint k = k0; k < k0 + push.rows; ++k) {
    vec4 sum = vec4(0.0);
    for (uint i = 0; i < 2; ++i) {
      uint row = 2 * k + i;
      vec4 a = block_sums(int(2 * tx), int(row)), b = block_sums(int(2 * tx + 1), int(row));
      if (row < push.coarse_height) {
        coarse[row * push.coarse_pitch + 2 * tx] = a;
        if (2 * tx + 1 < push.coarse_pitch) coarse[row * push.coarse_pitch + 2 * tx + 1] = b;
      }
      sum += vec4(a.xz + a.yw, b.xz + b.yw);
    }
    if (k < height) coarser[k * width + tx] = sum;
  }
}
