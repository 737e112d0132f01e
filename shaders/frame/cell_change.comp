// Change from the untouched image and its square, summed over cells of 4 x 4 px, for each colour. One invocation owns the four
// cells below a texel's width. Everything is integer, so the sums are the same on every device.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/cell_change.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;

TEXELS(0, uvec4, frame_texels);
TEXELS(1, uvec4, rest_texels);
layout(binding = 2) writeonly buffer Cells { CellChange cells[]; };
layout(push_constant) uniform Push { CellChangePush push; };

const uint CELLS = 4;  // to a texel

void main() {
  uint texels_x = (push.cells_x + CELLS - 1) / CELLS;
  if (gl_GlobalInvocationID.x >= texels_x * push.cells_y) return;
  uint texel = gl_GlobalInvocationID.x % texels_x, row = gl_GlobalInvocationID.x / texels_x;
  uint rows = min(kCellSide, push.height - row * kCellSide);
  ivec4 sums[3];
  uvec4 squares[3];
  for (uint plane = 0; plane < 3; ++plane) {
    ivec4 sum = ivec4(0), square = ivec4(0);
    for (uint i = 0; i < rows; ++i) {
      int at = int((plane * push.height + row * kCellSide + i) * push.pitch + texel + 1);
      uvec4 image = texelFetch(frame_texels, at), rest = texelFetch(rest_texels, at);
      for (uint b = 0; b < kCellSide; ++b) {
        uvec4 column = (texel * CELLS + uvec4(0, 1, 2, 3)) * kCellSide + b;
        ivec4 d = ivec4((image >> (8 * b)) & 0xffu) - ivec4((rest >> (8 * b)) & 0xffu);
        d *= ivec4(lessThan(column, uvec4(push.width)));
        sum += d;
        square += d * d;
      }
    }
    sums[plane] = sum;
    squares[plane] = uvec4(square);
  }
  uint end = min(CELLS, push.cells_x - texel * CELLS);
  for (uint c = 0; c < end; ++c)
    cells[row * push.cells_x + texel * CELLS + c] =
        CellChange(sums[0][c], sums[1][c], sums[2][c], squares[0][c], squares[1][c], squares[2][c]);
}
