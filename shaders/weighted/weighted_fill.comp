// Cells without any known face follow their neighbours: what their heights lack to being harmonic (RESIDUAL), as a right side for
// the preconditioner, and its answer added to them alone.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/weighted.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 16;
layout(push_constant) uniform Push { WeightedPush push; };
TEXELS(0, vec4, wx_texels);
TEXELS(1, float, wx_words);
TEXELS(2, vec4, wy_texels);
TEXELS(3, vec4, heights_texels);
#ifdef RESIDUAL
#define UNKNOWN_ONLY
TEXELS(4, float, heights_words);
layout(binding = 5) writeonly buffer Out { vec4 result[]; };
#else
#define KNOWN_ONLY
TEXELS(4, vec4, change_texels);
layout(binding = 5) writeonly buffer Out { vec4 result[]; };
#endif

#include "shaders/weighted/weighted_rows.glsl"

void main() {
  uint tiles_x = (push.pitch + 1) / 2, tiles = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles) return;
  int tx = int(tile % tiles_x), y0 = int(tile / tiles_x * TILE_ROWS), height = int(push.height);
  bool wide = 2 * tx + 1 < int(push.pitch);
  Faces above = faces_at(tx, y0 - 1);
#ifdef RESIDUAL
  Ten up = ten_at(heights_texels, heights_words, tx, y0 - 1), c = ten_at(heights_texels, heights_words, tx, y0);
#endif
  for (int y = y0; y < y0 + int(TILE_ROWS); ++y) {
    Faces here = faces_at(tx, y);
#ifdef RESIDUAL
    Ten down = ten_at(heights_texels, heights_words, tx, y + 1);
    Pair ax = apply(above, here, up, c, down);
    vec4 a = -ax.a, b = -ax.b;
    up = c;
    c = down;
#else
    Pair z = pair_at(heights_texels, tx, y), change = pair_at(change_texels, tx, y), d = diagonal(above, here);
    vec4 a = z.a + mix(vec4(0.0), change.a, equal(d.a, vec4(0.0)));
    vec4 b = z.b + mix(vec4(0.0), change.b, equal(d.b, vec4(0.0)));
#endif
    if (y < height) {
      uint at = uint(y) * push.pitch + 2 * uint(tx);
      result[at] = a;
      if (wide) result[at + 1] = b;
    }
    above = here;
  }
}
