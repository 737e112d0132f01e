// What flows through the missing faces of the cells at the edge of what is known, less what the sources there make up for already.
// An invocation owns one cell.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/grid.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { EdgePush push; };
TEXELS(0, uint, cells);    // each cell's place in a map
TEXELS(1, vec4, weights);  // of its left, right, upper and lower face, where missing
TEXELS(2, float, x_words);
TEXELS(3, float, sources);  // that the right side holds already
layout(binding = 4) writeonly buffer Out { float residual[]; };

float at(int word) { return texelFetch(x_words, clamp(word, 0, int(push.words) - 1)).x; }

void main() {
  uint cell = gl_GlobalInvocationID.x;
  if (cell >= 4 * push.groups) return;
  int word = int(texelFetch(cells, int(min(cell, push.cells - 1))).x);
  vec4 w = texelFetch(weights, int(min(cell, push.cells - 1)));
  float here = at(word), source = push.first != 0 ? 0.0 : texelFetch(sources, int(cell)).x;
  vec4 around = vec4(at(word - 1), at(word + 1), at(word - int(push.row)), at(word + int(push.row)));
  residual[cell] = cell < push.cells ? dot(w, here - around) - source : 0.0;
}
