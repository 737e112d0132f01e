// One relaxation sweep of a level of the preconditioner, x + step (right - A x) / diagonal, from a first sweep out of zero
// (START_ZERO), from the present solution plus the coarse level's correction (START_CORRECT), or from the present solution
// (START_PRESENT), which also leaves right times result, summed over the invocation's cells.
// An invocation owns eight columns and streams down TILE_ROWS rows.
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
TEXELS(3, vec4, right_texels);
#if defined(START_ZERO)
TEXELS(4, float, right_words);
TEXELS(5, float, wy_words);
layout(binding = 6) writeonly buffer Out { vec4 result[]; };
#elif defined(START_CORRECT)
TEXELS(4, vec4, x_texels);
TEXELS(5, float, x_words);
TEXELS(6, float, coarse_words);
layout(binding = 7) writeonly buffer Out { vec4 result[]; };
#else
TEXELS(4, vec4, x_texels);
TEXELS(5, float, x_words);
layout(binding = 6) writeonly buffer Out { vec4 result[]; };
layout(binding = 7) writeonly buffer Dots { float dots[]; };
#endif

#include "shaders/weighted/weighted_rows.glsl"

struct Row {
  Ten x;
  Pair right;
  Faces faces;
};

Row row_at(Faces above, int tx, int y) {
  Row r;
  r.faces = faces_at(tx, y);
#if defined(START_ZERO)
  // The first sweep of the two columns beside needs their own faces.
  Ten f = ten_at(right_texels, right_words, tx, y);
  r.right = Pair(f.a, f.b);
  Pair d = diagonal(above, r.faces);
  int row = row_start(y), before = row_start(y - 1), last = 4 * int(push.pitch) - 1;
  int left = max(8 * tx - 1, 0), right = min(8 * tx + 8, last);
  float up = y > 0 ? 1.0 : 0.0;
  float dl = r.faces.l + abs(texelFetch(wx_words, 4 * row + max(8 * tx - 2, 0)).x) + abs(texelFetch(wy_words, 4 * row + left).x) +
             up * abs(texelFetch(wy_words, 4 * before + left).x);
  float dr = r.faces.xb.w + abs(texelFetch(wx_words, 4 * row + right).x) + abs(texelFetch(wy_words, 4 * row + right).x) +
             up * abs(texelFetch(wy_words, 4 * before + right).x);
  r.x.l = push.step0 * over(f.l, dl);
  r.x.r = push.step0 * over(f.r, dr);
  r.x.a = push.step0 * over(f.a, d.a);
  r.x.b = push.step0 * over(f.b, d.b);
#else
  r.x = ten_at(x_texels, x_words, tx, y);
  r.right = pair_at(right_texels, tx, y);
#ifdef START_CORRECT
  int coarse = clamp(y, 0, int(push.height) - 1) / 2 * int(push.coarse_pitch) * 4, end = 4 * int(push.coarse_pitch) - 1;
  vec4 e = vec4(texelFetch(coarse_words, coarse + 4 * tx).x, texelFetch(coarse_words, coarse + 4 * tx + 1).x,
                texelFetch(coarse_words, coarse + 4 * tx + 2).x, texelFetch(coarse_words, coarse + 4 * tx + 3).x);
  r.x.l += texelFetch(coarse_words, coarse + max(4 * tx - 1, 0)).x;
  r.x.r += texelFetch(coarse_words, coarse + min(4 * tx + 4, end)).x;
  r.x.a += e.xxyy;
  r.x.b += e.zzww;
#endif
#endif
  return r;
}

void main() {
  uint tiles_x = (push.pitch + 1) / 2, tiles = (push.height + TILE_ROWS - 1) / TILE_ROWS;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles) return;
  int tx = int(tile % tiles_x), y0 = int(tile / tiles_x * TILE_ROWS), height = int(push.height);
  bool wide = 2 * tx + 1 < int(push.pitch);
#if defined(START_ZERO) || defined(START_CORRECT)
  float step = push.step1;
#else
  float step = push.step0;
#endif
  Row above = row_at(faces_at(tx, y0 - 2), tx, y0 - 1), here = row_at(above.faces, tx, y0);
  vec4 dot = vec4(0.0);
  for (int y = y0; y < y0 + int(TILE_ROWS); ++y) {
    Row below = row_at(here.faces, tx, y + 1);
    Pair ax = apply(above.faces, here.faces, above.x, here.x, below.x), d = diagonal(above.faces, here.faces);
    vec4 a = here.x.a + step * over(here.right.a - ax.a, d.a), b = here.x.b + step * over(here.right.b - ax.b, d.b);
    if (y < height) {
      uint at = uint(y) * push.pitch + 2 * uint(tx);
      result[at] = a;
      if (wide) result[at + 1] = b;
    }
    dot += y < height ? here.right.a * a + (wide ? here.right.b * b : vec4(0.0)) : vec4(0.0);
    above = here;
    here = below;
  }
#ifdef START_PRESENT
  dots[tile] = sum(dot);
#endif
}
