// What marked cells would show: the mean of the nearest known cells along their row and column by inverse distance (mean value
// coordinates: exact where the image is linear); with SUBTRACT of their change from the untouched image. A cell with none on
// opposite sides stays unknown. One invocation owns a word's cells. Everything is integer; known cells are only read and marked
// ones only written.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/markers.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SUBTRACT = 1;
TEXELS(0, uint, cells);
TEXELS(1, uint, rest_cells);
TEXELS(2, uint, marked);
layout(binding = 3) writeonly buffer Filled { uint filled[]; };
layout(binding = 4) writeonly buffer Unknown { uint unknown[]; };
layout(binding = 5) writeonly buffer Records { uint records[]; };
layout(push_constant) uniform Push { MarkersPush push; };

#include "shaders/frame/markers_masks.glsl"

ivec3 value_at(int cell) {
  ivec3 value = ivec3(unpack_cell(texelFetch(cells, cell).x));
  return SUBTRACT == 1 ? value - ivec3(unpack_cell(texelFetch(rest_cells, cell).x)) : value;
}

struct Sum {
  ivec3 values;
  int weights;
};

// Known cells of a word, a bit each.
uint known_at(int word, int y) {
  int inside = int(push.cells_x) - 32 * word;
  bool on = word >= 0 && inside > 0;
  uint bits = ~texelFetch(marked, y * int(push.words) + (on ? word : 0)).x & (0xffffffffu >> max(32 - inside, 0) % 32);
  return on ? bits : 0u;
}

// Cells to the nearest known one along the row, or 0 where there is none within reach. In these loops turns after the last that
// changes something change nothing: lavapipe makes them.
int along_row(ivec2 at, int way) {
  int word = at.x >> 5, i = at.x & 31, found = 0;
  uint own = way > 0 ? 0xfffffffeu << i : (1u << i) - 1u, bits = known_at(word, at.y) & own;
  bool further = true;
  do {
    int x = 32 * word + (way > 0 ? findLSB(bits) : findMSB(bits));
    found = further && bits != 0 ? abs(x - at.x) : found;
    word += way;
    int least = way > 0 ? 32 * word - at.x : at.x - 32 * word - 31;
    further = further && bits == 0 && least <= int(push.reach) && word >= 0 && word < int(push.words);
    bits = further ? known_at(word, at.y) : bits;
  } while (further);
  return found <= int(push.reach) ? found : 0;
}

int along_column(ivec2 at, int way) {
  int n = 0, found = 0, most = min(int(push.reach), way > 0 ? int(push.cells_y) - 1 - at.y : at.y);
  bool further = most > 0;
  do {
    n += further ? 1 : 0;
    bool known = further && (texelFetch(marked, word_at(at + ivec2(0, n * way))).x >> (uint(at.x) & 31u) & 1u) == 0;
    found = known ? n : found;
    further = further && !known && n < most;
  } while (further);
  return found;
}

void add(inout Sum sum, ivec2 at, int away) {
  int w = away > 0 ? int(kMarkerNear) / max(away, 1) : 0;
  sum.values += w * value_at(cell_at(at));
  sum.weights += w;
}

void main() {
  uint word = gl_GlobalInvocationID.x;
  if (word >= push.words * push.cells_y) return;
  ivec2 first = ivec2(32 * (word % push.words), word / push.words);
  uint bits = texelFetch(marked, int(word)).x, all_bits = bits, lost = 0;
  while (bits != 0) {
    int i = findLSB(bits);
    bits &= bits - 1;
    ivec2 at = first + ivec2(i, 0);
    Sum sum = Sum(ivec3(0), 0);
    int right = along_row(at, 1), left = along_row(at, -1), below = along_column(at, 1), above = along_column(at, -1);
    add(sum, at + ivec2(right, 0), right);
    add(sum, at - ivec2(left, 0), left);
    add(sum, at + ivec2(0, below), below);
    add(sum, at - ivec2(0, above), above);
    bool between = (right > 0 && left > 0) || (below > 0 && above > 0);
    int weights = max(sum.weights, 1);
    ivec3 value = (sum.values + mix(ivec3(weights / 2), ivec3(-weights / 2), lessThan(sum.values, ivec3(0)))) / weights;
    int cell = cell_at(at);
    if (SUBTRACT == 1) value += ivec3(unpack_cell(texelFetch(rest_cells, cell).x));
    if (between) filled[cell] = pack_cell(uvec3(clamp(value, ivec3(0), ivec3(kCellMost))));
    lost |= uint(!between) << i;
  }
  unknown[word] = lost;
  records[word] = uint(bitCount(all_bits)) | (uint(bitCount(lost)) << kMarkerCountBits);
}
