// As contact.comp without the filter: change from the untouched image (or the frame itself), threshold and moments. There is
// nothing to fetch beyond a tile's own pixels. Variants: WIDE (16-bit pixels), PLANES (1 or 3).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/contact.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 32;
layout(constant_id = 4) const uint SIGNAL = 0;    // 0 brighter, 1 darker, 2 either
layout(constant_id = 5) const uint SUBTRACT = 1;  // 0: the frame is the change already, the rest image is not read

layout(binding = 0) uniform usamplerBuffer frame_texels;
layout(binding = 1) uniform usamplerBuffer rest_texels;
layout(binding = 2) writeonly buffer Records { ContactRecord records[]; };
layout(push_constant) uniform Push { ContactPush push; };

#include "shaders/contact_sums.glsl"

// Adds one texel of a row.
void add_texel(inout Sums s, inout Whole whole, inout Row row, int at, bool here) {
  const Half none = Half(uvec4(0), uvec4(0));
  Half g = none, raw = none;
  for (int plane = 0; plane < PLANES; ++plane) {
    int from = plane * int(push.height) * int(push.pitch) + at;
    uvec4 image = texelFetch(frame_texels, from), rest = texelFetch(rest_texels, from);
    Half seen = Half(even_of(image), odd_of(image));
    if (PLANES == 1) {
      g = change(image, rest);
      raw = seen;
    } else {
      raise(g, change(image, rest));
      raise(raw, seen);
    }
  }
  notice_saturated(s, raw);
  add(s, whole, row, Half(g.even << 8, g.odd << 8), here);
}

void main() {
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles_x * push.tiles_y) return;
  uint tile_x = tile % push.tiles_x;
  int y0 = int(tile / push.tiles_x * TILE_ROWS);
  int height = int(push.height);
  Sums a = start(2 * tile_x * TEXEL_COLUMNS), b = start((2 * tile_x + 1) * TEXEL_COLUMNS);
  Whole whole = start_whole();

  for (int i = 0; i < int(TILE_ROWS); ++i) {
    int y = y0 + i;
    bool here = y < height;
    int at = min(y, height - 1) * int(push.pitch) + 2 * int(tile_x) + 1;
    Row row = start_row();
    add_texel(b, whole, row, at + 1, here);
    add_texel(a, whole, row, at, here);
    add_row(whole, row);
  }

  ContactRecord record = record_of(whole, a, b);
  int rows = any_saturated(a) || any_saturated(b) ? min(int(TILE_ROWS), height - y0) : 0;
  for (int i = 0; i < rows; ++i) {
    int at = (y0 + i) * int(push.pitch) + 2 * int(tile_x) + 1;
    record.saturated += count_saturated(a, at) + count_saturated(b, at + 1);
  }
  records[tile] = record;
}
