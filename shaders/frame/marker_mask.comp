// Marked cells: the dark ones with their rim, in the frame or (SUBTRACT) in the untouched image. One invocation owns a word.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/markers.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SUBTRACT = 1;
TEXELS(0, uint, dark);
TEXELS(1, uint, rest_marked);
layout(binding = 2) writeonly buffer Marked { uint marked[]; };
layout(push_constant) uniform Push { MarkersPush push; };

const int kRim = int(kMarkerRim);

uint fetch(int x, int row) { return x < 0 || x >= int(push.words) ? 0u : texelFetch(dark, row + x).x; }

void main() {
  uint word = gl_GlobalInvocationID.x;
  if (word >= push.words * push.cells_y) return;
  int x = int(word % push.words), y = int(word / push.words);
  uint bits = 0;
  for (int j = -kRim; j <= kRim; ++j) {
    int row = clamp(y + j, 0, int(push.cells_y) - 1) * int(push.words);
    uint left = fetch(x - 1, row), here = fetch(x, row), right = fetch(x + 1, row);
    bits |= here;
    for (int i = 1; i <= kRim; ++i) bits |= (here << i) | (here >> i) | (left >> (32 - i)) | (right << (32 - i));
  }
  int inside = min(int(push.cells_x) - 32 * x, 32);
  bits &= 0xffffffffu >> (32 - inside);
  if (SUBTRACT == 1) bits |= texelFetch(rest_marked, int(word)).x;
  marked[word] = bits;
}
