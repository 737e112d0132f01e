// The frame without its markers, padded as a frame is: a marked pixel is that of the untouched image and the change between the
// middles of cells, linear; with nothing known the untouched pixel. Without SUBTRACT what lies between the cells itself. One
// invocation owns a word of 4 px in a row of cells. Everything is integer.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/markers.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SUBTRACT = 1;
layout(constant_id = 4) const uint CELL = 2;
TEXELS(0, uint, frame_words);
TEXELS(1, uint, rest_words);
TEXELS(2, uint, cells);
TEXELS(3, uint, rest_cells);
TEXELS(4, uint, marked);
TEXELS(5, uint, unknown);
layout(binding = 6) writeonly buffer Filled { uint filled[]; };
layout(push_constant) uniform Push { MarkersPush push; };

#include "shaders/frame/markers_masks.glsl"

const int kCell = int(CELL);

bool bit_in(uint word, ivec2 cell) { return (word >> (uint(cell.x) & 31u) & 1u) != 0; }

ivec3 change_at(int x, int y) {
  ivec2 last = ivec2(push.cells_x, push.cells_y) - 1;
  int cell = cell_at(clamp(ivec2(x, y), ivec2(0), last));
  ivec3 value = ivec3(unpack_cell(texelFetch(cells, cell).x));
  return SUBTRACT == 1 ? value - ivec3(unpack_cell(texelFetch(rest_cells, cell).x)) : value;
}

#define bit_of(mask, cell) bit_in(texelFetch(mask, word_at(cell)).x, cell)

void main() {
  uint across = 4 * push.pitch;
  if (gl_GlobalInvocationID.x >= across * push.cells_y) return;
  int word = int(gl_GlobalInvocationID.x % across), cy = int(gl_GlobalInvocationID.x / across), height = int(push.height);
  int from[2];
  uvec3 seen[2], rest[2];
  for (int j = 0; j < kCell; ++j) {
    from[j] = min(kCell * cy + j, height - 1) * int(across) + word;
    for (int plane = 0; plane < 3; ++plane) {
      int at = plane * height * int(across) + from[j];
      seen[j][plane] = texelFetch(frame_words, at).x;
      rest[j][plane] = SUBTRACT == 1 ? texelFetch(rest_words, at).x : seen[j][plane];
    }
  }
  // Copies outside the frame are of its first and last pixel.
  ivec4 column = clamp(ivec4(0, 1, 2, 3) + (4 * word - 16), ivec4(0), ivec4(push.width - 1));
  bvec4 hit;
  for (int k = 0; k < 4; ++k) hit[k] = bit_of(marked, ivec2(column[k] / kCell, cy));
  // Words without a marker make no turn.
  int turns = any(hit) ? 4 : 0;
  for (int k = 0; k < turns; ++k) {
    int cx = column[k] / kCell, side = (column[k] & 1) == 0 ? -1 : 1;
    bool known = !bit_of(unknown, ivec2(cx, cy));
    ivec3 middle = 3 * change_at(cx, cy) + change_at(cx + side, cy);
    uint shift = 8 * uint(k), keep = hit[k] ? ~(255u << shift) : 0xffffffffu;
    for (int j = 0; j < kCell; ++j) {
      int beside = cy + 2 * j - 1;
      ivec3 value = CELL == 1 ? 16 * change_at(cx, cy) : 3 * middle + 3 * change_at(cx, beside) + change_at(cx + side, beside);
      ivec3 untouched = ivec3((rest[j] >> shift) & 255u);
      ivec3 pixel = clamp((SUBTRACT == 1 ? untouched : ivec3(0)) + ((value + 32) >> 6), ivec3(0), ivec3(255));
      seen[j] = (seen[j] & keep) | ((uvec3(known ? pixel : untouched) << shift) & ~keep);
    }
  }
  for (int j = 0; j < kCell; ++j)
    if (kCell * cy + j < height)
      for (int plane = 0; plane < 3; ++plane) filled[plane * height * int(across) + from[j]] = seen[j][plane];
}
