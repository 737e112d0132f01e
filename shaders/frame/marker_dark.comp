// Cells that are darker than the light around them, in every colour: a bit each. The light is linear between the middles of blocks.
// One invocation owns a word's 32 cells. Everything is integer.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/markers.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint CELL = 2;
TEXELS(0, uint, cells);
TEXELS(1, uint, light);
layout(binding = 2) writeonly buffer Dark { uint dark[]; };
layout(push_constant) uniform Push { MarkersPush push; };

#include "shaders/frame/markers_masks.glsl"

const int kSide = int(kMarkerBlock / CELL), kSteps = 2 * kSide;  // cells of a block; half cells

// Between two rows of blocks, kSteps times the light.
ivec3 light_at(int bx, ivec2 rows, int part) {
  int x = clamp(bx, 0, int(push.blocks_x) - 1);
  ivec3 above = ivec3(unpack_cell(texelFetch(light, rows.x + x).x)), below = ivec3(unpack_cell(texelFetch(light, rows.y + x).x));
  return (kSteps - part) * above + part * below;
}

void main() {
  uint word = gl_GlobalInvocationID.x;
  if (word >= push.words * push.cells_y) return;
  ivec2 first = ivec2(32 * (word % push.words), word / push.words);
  int v = 2 * first.y + 1 + kSide;  // half cells from the middle of the block before the first
  ivec2 rows = clamp(ivec2(v / kSteps - 1, v / kSteps), ivec2(0), ivec2(push.blocks_y - 1)) * int(push.blocks_x);
  int block = first.x / kSide - 1;
  ivec3 left = light_at(block, rows, v % kSteps);
  uint bits = 0;
  // Cells between the middles of two blocks: from half a block before the right one's first cell on.
  for (int gap = 0; gap <= 32 / kSide; ++gap) {
    ivec3 right = light_at(block + gap + 1, rows, v % kSteps);
    for (int k = 0; k < kSide; ++k) {
      int i = kSide * gap - kSide / 2 + k, part = 1 + 2 * k;
      bool own = i >= 0 && i < 32 && first.x + i < int(push.cells_x);
      ivec3 cell = ivec3(unpack_cell(texelFetch(cells, cell_at(first) + clamp(i, 0, 31)).x));
      ivec3 level = (kSteps - part) * left + part * right;
      ivec3 less = level - kSteps * kSteps * cell, above = level + kSteps * kSteps * int(kMarkerBlack);
      bool each = all(greaterThan(less * int(kMarkerDarkEach), above * int(push.threshold)));
      bool enough = (less.x + less.y + less.z) * int(kMarkerDark) > (above.x + above.y + above.z) * int(push.threshold);
      bits |= uint(own && each && enough) << (uint(i) & 31u);
    }
    left = right;
  }
  dark[word] = bits;
}
