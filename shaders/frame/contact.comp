// Background subtraction, 5x5 binomial filter, threshold and moments in one pass. Rows stream through registers; one invocation
// owns a tile two texels wide (32 pixels of 8 bits, 16 of 16) and TILE_ROWS high. Everything is integer, so the sums are exact
// and the same on every device. Variants: WIDE (16-bit pixels), PLANES (1 or 3), PARTS (sums of the parts that regions.comp found in a
// tile: one invocation owns a part).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/contact.h"
#include "shaders/shared/regions.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 32;
layout(constant_id = 4) const uint SIGNAL = 0;  // 0 brighter, 1 darker, 2 either
layout(constant_id = 5) const uint KEEP = 0;    // 1: store the filtered image
layout(constant_id = 6) const uint KEEP_SHIFT = 0;  // drops fraction bits so that a stored value fits 16 bits
layout(constant_id = 7) const uint SUBTRACT = 1;  // 0: the frame is the change already, the rest image is not read
layout(constant_id = 8) const uint KEEP_MARKS = 0;  // 1: store which pixels are contact

TEXELS(0, uvec4, frame_texels);
TEXELS(1, uint, frame_words);
TEXELS(2, uvec4, rest_texels);
TEXELS(3, uint, rest_words);
layout(binding = 4) writeonly buffer Records { ContactRecord records[]; };
#ifdef PARTS
layout(binding = 5) readonly buffer Parts { RegionPart parts[]; };
TEXELS(6, uint, part_marks);
layout(binding = 7) readonly buffer Count { uint part_count; };
#else
layout(binding = 5) writeonly buffer Filtered { uvec4 filtered[]; };
layout(binding = 6) writeonly buffer Marks { uint marks[]; };  // TILE_ROWS of a tile, a bit a pixel from the left
#endif
layout(push_constant) uniform Push { ContactPush push; };

#include "shaders/frame/contact_sums.glsl"

#ifdef WIDE
uvec4 from_left(uvec4 x, uvec4 left) { return left; }
uvec4 from_right(uvec4 x, uvec4 right) { return right; }
#else
uvec4 from_left(uvec4 x, uvec4 left) { return (x << 16) | (left >> 16); }
uvec4 from_right(uvec4 x, uvec4 right) { return (x >> 16) | (right << 16); }
#endif

struct Fetched {
  Half a, b;          // two texels, horizontally filtered, weights 1 4 6 4 1
  Half raw_a, raw_b;  // brightest plane as the camera sees it, to count saturation
};

// `left` and `right` hold the neighbouring words, even lanes in x and odd lanes in y.
Half filter_across(Half h, uvec2 left, uvec2 right) {
  uvec4 even_2l = from_left(h.even, uvec4(left.x, h.even.xyz));
  uvec4 even_2r = from_right(h.even, uvec4(h.even.yzw, right.x));
  uvec4 odd_1l = from_left(h.odd, uvec4(left.y, h.odd.xyz));
  uvec4 odd_2r = from_right(h.odd, uvec4(h.odd.yzw, right.y));
  return Half(even_2l + even_2r + ((odd_1l + h.even + h.odd) << 2) + (h.even << 1),
              odd_1l + odd_2r + ((h.even + h.odd + even_2r) << 2) + (h.odd << 1));
}

Fetched fetch_row(uint tile_x, int y) {
  int row = clamp(y, 0, int(push.height) - 1);
  const Half none = Half(uvec4(0), uvec4(0));
  Half a = none, b = none, raw_a = none, raw_b = none;
  uvec2 left = uvec2(0), right = uvec2(0);
  for (int plane = 0; plane < PLANES; ++plane) {
    int at = (plane * int(push.height) + row) * int(push.pitch) + 2 * int(tile_x) + 1;
    uvec4 image_a = texelFetch(frame_texels, at), rest_a = texelFetch(rest_texels, at);
    uvec4 image_b = texelFetch(frame_texels, at + 1), rest_b = texelFetch(rest_texels, at + 1);
    uint image_l = texelFetch(frame_words, at * 4 - 1).x, rest_l = texelFetch(rest_words, at * 4 - 1).x;
    uint image_r = texelFetch(frame_words, at * 4 + 8).x, rest_r = texelFetch(rest_words, at * 4 + 8).x;
    Half change_a = change(image_a, rest_a), change_b = change(image_b, rest_b);
    uvec4 beside = change_lanes(uvec4(even_of(image_l), odd_of(image_l), even_of(image_r), odd_of(image_r)),
                                uvec4(even_of(rest_l), odd_of(rest_l), even_of(rest_r), odd_of(rest_r)));
    Half seen_a = Half(even_of(image_a), odd_of(image_a)), seen_b = Half(even_of(image_b), odd_of(image_b));
    if (PLANES == 1) {
      a = change_a;
      b = change_b;
      left = beside.xy;
      right = beside.zw;
      raw_a = seen_a;
      raw_b = seen_b;
    } else {
      raise(a, change_a);
      raise(b, change_b);
      uvec4 sides = uvec4(left, right);
      sides += above(beside, sides);
      left = sides.xy;
      right = sides.zw;
      raise(raw_a, seen_a);
      raise(raw_b, seen_b);
    }
  }
  return Fetched(filter_across(a, left, uvec2(b.even.x, b.odd.x)), filter_across(b, uvec2(a.even.w, a.odd.w), right), raw_a, raw_b);
}

// The vertical filter is four running pair sums, (1 + z)^4: additions only, and no lane exceeds 16 bits on the way.
struct Column {
  uvec4 s0, s1, s2, s3;
};
struct Columns {
  Column even, odd;
};
uvec4 filter_down(inout Column c, uvec4 h) {
  uvec4 a = h + c.s0, b = a + c.s1, d = b + c.s2, v = d + c.s3;
  c.s0 = h;
  c.s1 = a;
  c.s2 = b;
  c.s3 = d;
  return v;
}
Half filter_down(inout Columns c, Half h) { return Half(filter_down(c.even, h.even), filter_down(c.odd, h.odd)); }

#ifndef PARTS
// Two texels' filtered pixels as the slope stage reads them, 16 bits each, in order.
void keep(Half v, uint texel) {
#ifdef WIDE
  filtered[texel] = (v.even >> KEEP_SHIFT) | ((v.odd >> KEEP_SHIFT) << 16);
#else
  uvec4 low = (v.even & 0xffffu) | (v.odd << 16), high = (v.even >> 16) | (v.odd & 0xffff0000u);
  filtered[texel] = uvec4(low.x, high.x, low.y, high.y);
  filtered[texel + 1] = uvec4(low.z, high.z, low.w, high.w);
#endif
}
#endif

void main() {
#ifdef PARTS
  uint part = gl_GlobalInvocationID.x;
  if (part >= push.parts) return;
  // Without a part no loop makes a turn.
  bool given = part < part_count;
  uint tile = given ? parts[part].tile : 0;
  int first_row = given ? int(parts[part].first_row) : 0, last_row = given ? int(parts[part].last_row) : 0;
  int lead_in = given ? 4 : 0, rows = given ? int(TILE_ROWS) : 0;
#else
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles_x * push.tiles_y) return;
  const int lead_in = 4, rows = int(TILE_ROWS);
  uint ends = 0;
#endif
  uint tile_x = tile % push.tiles_x;
  int y0 = int(tile / push.tiles_x * TILE_ROWS);
  int height = int(push.height);
  Sums a = start(2 * tile_x * TEXEL_COLUMNS), b = start((2 * tile_x + 1) * TEXEL_COLUMNS);
  const Column empty = Column(uvec4(0), uvec4(0), uvec4(0), uvec4(0));
  Columns down_a = Columns(empty, empty), down_b = down_a;
  Whole whole = start_whole();

  for (int i = 0; i < lead_in; ++i) {
    Fetched r = fetch_row(tile_x, y0 - 2 + i);
    filter_down(down_a, r.a);
    filter_down(down_b, r.b);
    // Rows of neighbouring tiles only cost a needless count.
    notice_saturated(a, r.raw_a);
    notice_saturated(b, r.raw_b);
  }

  for (int i = 0; i < rows; ++i) {
    int y = y0 + i;
    Fetched r = fetch_row(tile_x, y + 2);
    Half v_a = filter_down(down_a, r.a), v_b = filter_down(down_b, r.b);
    notice_saturated(a, r.raw_a);
    notice_saturated(b, r.raw_b);
#ifdef PARTS
    uint own = i >= first_row && i <= last_row ? texelFetch(part_marks, int(part * kMaxTileRows) + i).x : 0;
    a.inside = unpack(own & ((1u << TEXEL_COLUMNS) - 1));
    b.inside = unpack(own >> TEXEL_COLUMNS);
#else
    if (KEEP == 1 && y < height) {
      uint texel = (uint(y) * push.tiles_x + tile_x) * (TEXEL_COLUMNS / 4);
      keep(v_a, texel);
      keep(v_b, texel + TEXEL_COLUMNS / 8);
    }
#endif
    Row row = start_row();
    uvec4 marks_b = add(b, whole, row, v_b, y < height), marks_a = add(a, whole, row, v_a, y < height);
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
