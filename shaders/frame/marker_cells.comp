// Pixels to cells, and the light of blocks of 8 x 8 px: the mean of their squares of 2 x 2 px that are not darker than the block's
// own mean, so that a marker's edge leaves it. One invocation owns the two blocks below a texel's width. Everything is integer.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/markers.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint CELL = 2;
TEXELS(0, uvec4, frame_texels);
layout(binding = 1) writeonly buffer Cells { uvec4 cells[]; };
layout(binding = 2) writeonly buffer Light { uint light[]; };
layout(push_constant) uniform Push { MarkersPush push; };

#include "shaders/frame/markers_masks.glsl"

const int kRows = int(kMarkerBlock) / 2;

// Sums of the eight squares below one texel in two rows of pixels: the even ones in the low halves, the odd ones in the high.
uvec4 cell_row(int plane, int texel, int row) {
  const uvec4 low = uvec4(0x00ff00ffu);
  uvec4 sum = uvec4(0);
  for (int i = 0; i < 2; ++i) {
    int y = min(2 * row + i, int(push.height) - 1);
    uvec4 t = texelFetch(frame_texels, (plane * int(push.height) + y) * int(push.pitch) + texel + 1);
    sum += (t & low) + ((t >> 8) & low);
  }
  return sum;
}

// Cells of one pixel.
void store_pixels(int texel, int by) {
  for (int y = int(kMarkerBlock) * by; y < min(int(kMarkerBlock) * (by + 1), int(push.height)); ++y) {
    uvec4 row[4];
    for (int i = 0; i < 4; ++i) row[i] = uvec4(0);
    for (int plane = 0; plane < 3; ++plane) {
      uvec4 t = texelFetch(frame_texels, (plane * int(push.height) + y) * int(push.pitch) + texel + 1);
      for (int i = 0; i < 4; ++i) row[i] |= (((uvec4(t[i]) >> uvec4(0, 8, 16, 24)) & 255u) * 4u) << (kCellBits * uint(plane));
    }
    int to = cell_at(ivec2(16 * texel, y)) / 4;
    for (int i = 0; i < 4; ++i) cells[to + i] = row[i];
  }
}

uvec2 both(uvec4 v) { return v.xz + v.yw; }

void main() {
  uint texels = (push.width + 15) / 16;
  if (gl_GlobalInvocationID.x >= texels * push.blocks_y) return;
  int texel = int(gl_GlobalInvocationID.x % texels), by = int(gl_GlobalInvocationID.x / texels);
  uvec4 column = uvec4(0, 4, 8, 12) + uint(16 * texel);
  uvec4 inside_even = uvec4(lessThan(column, uvec4(push.width))), inside_odd = uvec4(lessThan(column + 2, uvec4(push.width)));
  uvec4 packed_even[kRows], packed_odd[kRows];
  for (int j = 0; j < kRows; ++j) packed_even[j] = packed_odd[j] = uvec4(0);
  uvec2 blocks = uvec2(0);
  for (int plane = 0; plane < 3; ++plane) {
    uint shift = kCellBits * uint(plane);
    uvec4 even[kRows], odd[kRows];
    uvec2 all = uvec2(0), count = uvec2(0);
    for (int j = 0; j < kRows; ++j) {
      uvec4 sums = cell_row(plane, texel, kRows * by + j);
      even[j] = sums & 0xffffu;
      odd[j] = sums >> 16;
      packed_even[j] |= even[j] << shift;
      packed_odd[j] |= odd[j] << shift;
      uint here = uint(2 * (kRows * by + j) < int(push.height));
      all += here * both(inside_even * even[j] + inside_odd * odd[j]);
      count += here * both(inside_even + inside_odd);
    }
    uvec4 count4 = count.xxyy, all4 = all.xxyy;
    uvec2 sum = uvec2(0), bright = uvec2(0);
    for (int j = 0; j < kRows; ++j) {
      uint here = uint(2 * (kRows * by + j) < int(push.height));
      uvec4 is_even = here * inside_even * uvec4(greaterThanEqual(even[j] * count4, all4));
      uvec4 is_odd = here * inside_odd * uvec4(greaterThanEqual(odd[j] * count4, all4));
      sum += both(is_even * even[j] + is_odd * odd[j]);
      bright += both(is_even + is_odd);
    }
    blocks |= (sum / max(bright, uvec2(1))) << shift;
  }
  if (CELL == 1) store_pixels(texel, by);
  for (int j = 0; j < kRows; ++j) {
    int row = kRows * by + j;
    if (CELL == 1 || row >= int(push.cells_y)) continue;
    int to = cell_at(ivec2(8 * texel, row)) / 4;
    uvec4 a = packed_even[j], b = packed_odd[j];
    cells[to] = uvec4(a.x, b.x, a.y, b.y);
    cells[to + 1] = uvec4(a.z, b.z, a.w, b.w);
  }
  uint block = uint(by) * push.blocks_x + 2 * uint(texel);
  light[block] = blocks.x;
  if (2 * uint(texel) + 1 < push.blocks_x) light[block + 1] = blocks.y;
}
