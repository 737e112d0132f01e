// As contact.comp without the filter: change from the untouched image (or the frame itself), threshold and moments. There is
// nothing to fetch beyond a tile's own pixels. Variants: WIDE (16-bit pixels), PLANES (1 or 3), PARTS.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/contact.h"
#include "shaders/shared/regions.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 32;
layout(constant_id = 4) const uint SIGNAL = 0;    // 0 brighter, 1 darker, 2 either
layout(constant_id = 5) const uint SUBTRACT = 1;  // 0: the frame is the change already, the rest image is not read
layout(constant_id = 6) const uint KEEP_MARKS = 0;  // 1: store which pixels are contact

TEXELS(0, uvec4, frame_texels);
TEXELS(1, uvec4, rest_texels);
layout(binding = 2) writeonly buffer Records { ContactRecord records[]; };
#ifdef PARTS
layout(binding = 3) readonly buffer Parts { RegionPart parts[]; };
TEXELS(4, uint, part_marks);
layout(binding = 5) readonly buffer Count { uint part_count; };
#else
layout(binding = 3) writeonly buffer Marks { uint marks[]; };
#endif
layout(push_constant) uniform Push { ContactPush push; };

#include "shaders/frame/contact_sums.glsl"

// Adds one texel of a row; returns the marks of its contact pixels.
uvec4 add_texel(inout Sums s, inout Whole whole, inout Row row, int at, bool here) {
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
  return add(s, whole, row, Half(g.even << 8, g.odd << 8), here);
}

void main() {
#ifdef PARTS
  uint part = gl_GlobalInvocationID.x;
  if (part >= push.parts) return;
  // Without a part no loop makes a turn.
  bool given = part < part_count;
  uint tile = given ? parts[part].tile : 0;
  int first_row = given ? int(parts[part].first_row) : 0, last_row = given ? int(parts[part].last_row) : 0;
  int rows = given ? int(TILE_ROWS) : 0;
#else
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles_x * push.tiles_y) return;
  const int rows = int(TILE_ROWS);
  uint ends = 0;
#endif
  uint tile_x = tile % push.tiles_x;
  int y0 = int(tile / push.tiles_x * TILE_ROWS);
  int height = int(push.height);
  Sums a = start(2 * tile_x * TEXEL_COLUMNS), b = start((2 * tile_x + 1) * TEXEL_COLUMNS);
  Whole whole = start_whole();

  for (int i = 0; i < rows; ++i) {
    int y = y0 + i;
    bool here = y < height;
    int at = min(y, height - 1) * int(push.pitch) + 2 * int(tile_x) + 1;
#ifdef PARTS
    uint own = i >= first_row && i <= last_row ? texelFetch(part_marks, int(part * kMaxTileRows) + i).x : 0;
    a.inside = unpack(own & ((1u << TEXEL_COLUMNS) - 1));
    b.inside = unpack(own >> TEXEL_COLUMNS);
#endif
    Row row = start_row();
    uvec4 marks_b = add_texel(b, whole, row, at + 1, here), marks_a = add_texel(a, whole, row, at, here);
    add_row(whole, row);
#ifndef PARTS
    ends |= at_ends(y, row.count);
    if (KEEP_MARKS == 1) marks[tile * TILE_ROWS + i] = pack(marks_a) | (pack(marks_b) << TEXEL_COLUMNS);
#endif
  }

  ContactRecord record = record_of(whole, a, b);
#ifdef PARTS
  // Tiles without saturated pixels make no turn here; each row counts its own pixels.
  int counted = given && parts[part].saturated > 0 ? last_row + 1 : 0;
  for (int i = first_row; i < counted; ++i) {
    uint own = texelFetch(part_marks, int(part * kMaxTileRows) + i).x;
    a.inside = unpack(own & ((1u << TEXEL_COLUMNS) - 1));
    b.inside = unpack(own >> TEXEL_COLUMNS);
    int at = (y0 + i) * int(push.pitch) + 2 * int(tile_x) + 1;
    record.saturated += count_saturated(a, at) + count_saturated(b, at + 1);
  }
  if (given) records[part] = record;
#else
  record.border = ends != 0 || at_sides(2 * tile_x * TEXEL_COLUMNS, a, b) ? 1 : 0;
  int full = any_saturated(a) || any_saturated(b) ? min(int(TILE_ROWS), height - y0) : 0;
  for (int i = 0; i < full; ++i) {
    int at = (y0 + i) * int(push.pitch) + 2 * int(tile_x) + 1;
    record.saturated += count_saturated(a, at) + count_saturated(b, at + 1);
  }
  records[tile] = record;
#endif
}
