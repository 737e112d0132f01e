// The finest level of a live solve: the heights of cells of two by two pixels, interpolated. A sweep here would cost two thirds of the
// solve and sharpen nothing but what is narrower than four pixels.
// An invocation owns eight columns and streams down push.rows rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/texels.glsl"
#include "shaders/surface/grid.glsl"
#include "shaders/frame/cubic.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { GridPush push; };
TEXELS(0, vec4, coarse_texels);
TEXELS(1, vec2, coarse_pairs);
layout(binding = 2) writeonly buffer Out { vec4 result[]; };

// One coarse row at eight fine columns.
Eight row_at(int tx, int k, Cubics even, Cubics odd) {
  int width = int(push.coarse_width), first = 4 * tx, row = clamp(k, 0, int(push.coarse_height) - 1) * int(push.coarse_pitch);
  vec4 c = texelFetch(coarse_texels, row + tx);
  vec2 l = texelFetch(coarse_pairs, 2 * row + max(2 * tx - 1, 0)).xy;
  vec2 r = texelFetch(coarse_pairs, 2 * row + min(2 * tx + 2, 2 * int(push.coarse_pitch) - 1)).xy;
  l.y = first == 0 ? c.x : l.y;
  c.y = first + 1 < width ? c.y : 2.0 * c.x - l.y;
  l = first == 0 ? vec2(3.0 * c.x - 2.0 * c.y, 2.0 * c.x - c.y) : l;
  c.z = first + 2 < width ? c.z : 2.0 * c.y - c.x;
  c.w = first + 3 < width ? c.w : 2.0 * c.z - c.y;
  r.x = first + 4 < width ? r.x : 2.0 * c.w - c.z;
  r.y = first + 5 < width ? r.y : 2.0 * r.x - c.w;
  vec4 left = vec4(l.y, c.xyz), right = vec4(c.yzw, r.x);
  vec4 e = blend(even, vec4(l, c.xy), left, c, right), o = blend(odd, vec4(c.zw, r), right, c, left);
  return Eight(vec4(e.x, o.x, e.y, o.y), vec4(e.z, o.z, e.w, o.w));
}

void put(Eight row, int y, int y1, int tx) {
  uint texel = uint(y) * push.pitch + 2 * uint(tx);
  if (y < y1) {
    result[texel] = row.a;
    if (2 * uint(tx) + 1 < push.pitch) result[texel + 1] = row.b;
  }
}

void main() {
  uint tiles_x = (push.pitch + 1) / 2, tiles_y = (push.height + push.rows - 1) / push.rows;
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= tiles_x * tiles_y) return;
  int tx = int(tile % tiles_x), y0 = int(tile / tiles_x * push.rows);
  int height = int(push.height), coarse_height = int(push.coarse_height), y1 = min(y0 + int(push.rows), height);
  Cubics even = cubics(8 * tx, int(push.width), push.edge_width), odd = cubics(8 * tx + 1, int(push.width), push.edge_width);

  // Two fine rows for each coarse row k.
  int k = y0 / 2;
  Eight above2 = row_at(tx, k - 2, even, odd), above = row_at(tx, k - 1, even, odd), here = row_at(tx, k, even, odd),
        below = row_at(tx, k + 1, even, odd);
  below = choose(k + 1 < coarse_height, below, onward(here, above));
  above = choose(k == 0, onward(here, below), above);
  above2 = choose(k == 0, onward(above, here), above2);
  for (int y = y0; y < y0 + int(push.rows); y += 2, ++k) {
    Eight below2 = choose(k + 2 < coarse_height, row_at(tx, k + 2, even, odd), onward(below, here));
    put(blend(cubic(y, height, push.edge_height), above2, above, here, below), y, y1, tx);
    put(blend(cubic(y + 1, height, push.edge_height), below2, below, here, above), y + 1, y1, tx);
    above2 = above;
    above = here;
    here = below;
    below = below2;
  }
}
