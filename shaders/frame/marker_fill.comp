// What marked cells would show: the mean of the nearest known cells in eight directions by their inverse distance (mean value
// coordinates: exact where the image is linear); with SUBTRACT of their change from the untouched image. A cell with none on
// opposite sides stays unknown. One invocation owns a word's cells. Everything is integer; known cells are only read and marked
// ones only written.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/markers.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint SUBTRACT = 1;
layout(binding = 0) uniform usamplerBuffer cells;
layout(binding = 1) uniform usamplerBuffer rest_cells;
layout(binding = 2) uniform usamplerBuffer marked;
layout(binding = 3) writeonly buffer Filled { uint filled[]; };
layout(binding = 4) writeonly buffer Unknown { uint unknown[]; };
layout(binding = 5) writeonly buffer Records { uint records[]; };
layout(push_constant) uniform Push { MarkersPush push; };

#include "shaders/frame/markers_masks.glsl"

bool inside(ivec2 at) { return all(greaterThanEqual(at, ivec2(0))) && at.x < int(push.cells_x) && at.y < int(push.cells_y); }

ivec3 value_at(int cell) {
  ivec3 value = ivec3(unpack_cell(texelFetch(cells, cell).x));
  return SUBTRACT == 1 ? value - ivec3(unpack_cell(texelFetch(rest_cells, cell).x)) : value;
}

struct Sum {
  ivec3 values;
  int weights;
};

// Adds the nearest known cell along `way`; whether there is one. Turns after the last change nothing.
bool look(inout Sum sum, ivec2 from, ivec2 way, uint weight) {
  int n = 0, found = 0;
  bool further = true;
  do {
    ++n;
    ivec2 at = from + n * way;
    further = further && inside(at);
    at = further ? at : from;
    bool known = further && (texelFetch(marked, word_at(at)).x >> (uint(at.x) & 31u) & 1u) == 0;
    found = known ? n : found;
    further = further && !known && n < int(push.reach);
  } while (further);
  int w = found > 0 ? int(weight) / max(found, 1) : 0;
  sum.values += w * value_at(cell_at(from + found * way));
  sum.weights += w;
  return found > 0;
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
    bool between = false;
    for (int d = 0; d < 4; ++d) {
      ivec2 way = d == 0 ? ivec2(1, 0) : d == 1 ? ivec2(1, 1) : d == 2 ? ivec2(0, 1) : ivec2(-1, 1);
      uint weight = (d & 1) == 0 ? kMarkerNear : kMarkerNearDiagonal;
      bool after = look(sum, at, way, weight), before = look(sum, at, -way, weight);
      between = between || (after && before);
    }
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
