// Background subtraction, 5x5 binomial filter, threshold and moments in one pass. Rows stream through registers; one invocation
// owns a tile two texels wide (32 pixels of 8 bits, 16 of 16) and TILE_ROWS high. Everything is integer, so the sums are exact
// and the same on every device. Variants: WIDE (16-bit pixels), PLANES (1 or 3).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/contact.h"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 32;
layout(constant_id = 4) const uint SIGNAL = 0;  // 0 brighter, 1 darker, 2 either
layout(constant_id = 5) const uint KEEP = 0;    // 1: store the filtered image
layout(constant_id = 6) const uint KEEP_SHIFT = 0;  // drops fraction bits so that a stored value fits 16 bits

layout(binding = 0) uniform usamplerBuffer frame_texels;
layout(binding = 1) uniform usamplerBuffer frame_words;
layout(binding = 2) uniform usamplerBuffer rest_texels;
layout(binding = 3) uniform usamplerBuffer rest_words;
layout(binding = 4) writeonly buffer Records { ContactRecord records[]; };
layout(binding = 5) writeonly buffer Filtered { uvec4 filtered[]; };
layout(push_constant) uniform Push { ContactPush push; };

// A register word holds two pixels of 8 bits in 16-bit lanes (even pixels p0 p2, odd pixels p1 p3), or one pixel of 16 bits in
// 32 (even p0, odd p1). `even` and `odd` are four words each: 16 or 8 neighbouring pixels.
#ifdef WIDE
const uint ONES = 0x00000001u;
const uint LANE = 0xffffffffu;
const uint TEXEL_COLUMNS = 8u;
uint even_of(uint w) { return w & 0xffffu; }
uint odd_of(uint w) { return w >> 16; }
uvec4 even_of(uvec4 w) { return w & 0xffffu; }
uvec4 odd_of(uvec4 w) { return w >> 16; }
uvec4 above(uvec4 a, uvec4 b) { return a - min(a, b); }
uvec4 from_left(uvec4 x, uvec4 left) { return left; }
uvec4 from_right(uvec4 x, uvec4 right) { return right; }
uvec4 at_least(uvec4 v, uint limit) { return uvec4(greaterThanEqual(v, uvec4(limit))); }
#else
const uint ONES = 0x00010001u;
const uint LANE = 0xffffu;
const uint TEXEL_COLUMNS = 16u;
uint even_of(uint w) { return w & 0x00ff00ffu; }
uint odd_of(uint w) { return (w >> 8) & 0x00ff00ffu; }
uvec4 even_of(uvec4 w) { return w & 0x00ff00ffu; }
uvec4 odd_of(uvec4 w) { return (w >> 8) & 0x00ff00ffu; }
// max(0, a - b) in each lane: bit 8 survives the subtraction exactly where a >= b.
uvec4 above(uvec4 a, uvec4 b) {
  uvec4 t = (a | 0x01000100u) - b;
  return t & (((t >> 8) & ONES) * 0xffu);
}
uvec4 from_left(uvec4 x, uvec4 left) { return (x << 16) | (left >> 16); }
uvec4 from_right(uvec4 x, uvec4 right) { return (x >> 16) | (right << 16); }
#endif

uvec4 change_lanes(uvec4 image, uvec4 rest) {
  if (SIGNAL == 0) return above(image, rest);
  if (SIGNAL == 1) return above(rest, image);
  return above(image, rest) | above(rest, image);
}

// One texel's pixels of a row.
struct Half {
  uvec4 even, odd;
};

struct Row {
  Half a, b;          // two texels, horizontally filtered, weights 1 4 6 4 1
  Half raw_a, raw_b;  // brightest plane as the camera sees it, to count saturation
};

Half change(uvec4 image, uvec4 rest) {
  return Half(change_lanes(even_of(image), even_of(rest)), change_lanes(odd_of(image), odd_of(rest)));
}
// The larger of two lanes is a + max(0, b - a).
void raise(inout Half h, Half other) {
  h.even += above(other.even, h.even);
  h.odd += above(other.odd, h.odd);
}

// `left` and `right` hold the neighbouring words, even lanes in x and odd lanes in y.
Half filter_across(Half h, uvec2 left, uvec2 right) {
  uvec4 even_2l = from_left(h.even, uvec4(left.x, h.even.xyz));
  uvec4 even_2r = from_right(h.even, uvec4(h.even.yzw, right.x));
  uvec4 odd_1l = from_left(h.odd, uvec4(left.y, h.odd.xyz));
  uvec4 odd_2r = from_right(h.odd, uvec4(h.odd.yzw, right.y));
  return Half(even_2l + even_2r + ((odd_1l + h.even + h.odd) << 2) + (h.even << 1),
              odd_1l + odd_2r + ((h.even + h.odd + even_2r) << 2) + (h.odd << 1));
}

Row fetch_row(uint tile_x, int y) {
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
  return Row(filter_across(a, left, uvec2(b.even.x, b.odd.x)), filter_across(b, uvec2(a.even.w, a.odd.w), right), raw_a, raw_b);
}

// The vertical filter is four running pair sums, (1 + z)^4: additions only, and no lane exceeds 16 bits on the way.
struct Column {
  uvec4 s0, s1, s2, s3;
};
uvec4 filter_down(inout Column c, uvec4 h) {
  uvec4 a = h + c.s0, b = a + c.s1, d = b + c.s2, v = d + c.s3;
  c.s0 = h;
  c.s1 = a;
  c.s2 = b;
  c.s3 = d;
  return v;
}

uint sum4(uvec4 v) { return v.x + v.y + v.z + v.w; }
uint max4(uvec4 v) { return max(max(v.x, v.y), max(v.z, v.w)); }

// Lanes of column sums -> contributions weighted with the column index. `first` is the column of word 0's low lane; words are
// four (or two) columns apart and lanes two.
void weigh(uvec4 lanes, uint first, inout uint s0, inout uint s1, inout uint s2) {
#ifdef WIDE
  uvec4 column = uvec4(0, 2, 4, 6) + first;
#else
  uvec4 column = uvec4(0, 4, 8, 12) + first;
#endif
  s0 += sum4(lanes);
  s1 += sum4(lanes * column);
  s2 += sum4(lanes * column * column);
}
void weigh_words(uvec4 even, uvec4 odd, uint first, inout uint s0, inout uint s1, inout uint s2) {
#ifdef WIDE
  weigh(even, first, s0, s1, s2);
  weigh(odd, first + 1, s0, s1, s2);
#else
  weigh(even & 0xffffu, first, s0, s1, s2);
  weigh(odd & 0xffffu, first + 1, s0, s1, s2);
  weigh(even >> 16, first + 2, s0, s1, s2);
  weigh(odd >> 16, first + 3, s0, s1, s2);
#endif
}

// 1 in every lane whose column lies inside the image; `column` is that of the first lane.
uvec4 inside(uint column) {
#ifdef WIDE
  return uvec4(lessThan(uvec4(0, 2, 4, 6) + column, uvec4(push.width)));
#else
  uvec4 columns = uvec4(0, 4, 8, 12) + column;
  return uvec4(lessThan(columns, uvec4(push.width))) | (uvec4(lessThan(columns + 2, uvec4(push.width))) << 16);
#endif
}

// Everything that one texel of the tile gathers on its way down.
struct Sums {
  Column even, odd;
  Half inside;
  Half saturated;
  Half n, k1, k2;
#ifdef WIDE
  Half gray;
#else
  Half gray_low, gray_high;  // low and high lanes
#endif
  uvec4 peak;
};

Sums start(uint column) {
  const uvec4 zero = uvec4(0);
  const Half none = Half(zero, zero);
  const Column empty = Column(zero, zero, zero, zero);
  Half within = Half(inside(column), inside(column + 1));
#ifdef WIDE
  return Sums(empty, empty, within, none, none, none, none, none, zero);
#else
  return Sums(empty, empty, within, none, none, none, none, none, none, zero);
#endif
}

void count_saturated(inout Sums s, Half raw, uint counts) {
#ifdef WIDE
  s.saturated.even += at_least(raw.even, push.saturation) & s.inside.even & counts;
  s.saturated.odd += at_least(raw.odd, push.saturation) & s.inside.odd & counts;
#else
  uint full = (0x8000u - min(push.saturation, 0x8000u)) * ONES;  // adding it carries into bit 15 from saturation on
  s.saturated.even += ((raw.even + full) >> 15) & s.inside.even & counts;
  s.saturated.odd += ((raw.odd + full) >> 15) & s.inside.odd & counts;
#endif
}

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

// Adds one filtered row; returns its gray sum.
uint add_row(inout Sums s, Half v, uint here) {
#ifdef WIDE
  Half m = Half(at_least(v.even, push.threshold * 2) & s.inside.even & here, at_least(v.odd, push.threshold * 2) & s.inside.odd & here);
#else
  uint reach = (0x8000u - push.threshold) * ONES;  // adding it carries into bit 15 from the threshold on
  Half m = Half(((((v.even >> 1) & 0x7fff7fffu) + reach) >> 15) & s.inside.even & here,
                ((((v.odd >> 1) & 0x7fff7fffu) + reach) >> 15) & s.inside.odd & here);
#endif
  // Rows are weighted by sums of sums: after the last row a row's mark was added once for each row from it to the bottom.
  s.n.even += m.even;
  s.n.odd += m.odd;
  s.k1.even += s.n.even;
  s.k1.odd += s.n.odd;
  s.k2.even += s.k1.even;
  s.k2.odd += s.k1.odd;
  v.even &= m.even * LANE;
  v.odd &= m.odd * LANE;
#ifdef WIDE
  s.gray.even += v.even;
  s.gray.odd += v.odd;
  s.peak = max(s.peak, max(v.even, v.odd));
  return sum4(v.even + v.odd);
#else
  uvec4 e0 = v.even & 0xffffu, e1 = v.even >> 16, o0 = v.odd & 0xffffu, o1 = v.odd >> 16;
  s.gray_low.even += e0;
  s.gray_high.even += e1;
  s.gray_low.odd += o0;
  s.gray_high.odd += o1;
  s.peak = max(s.peak, max(max(e0, e1), max(o0, o1)));
  return sum4(e0 + e1 + o0 + o1);
#endif
}

// Adds a texel's sums to the tile's record; `first` is the texel's first column in the tile.
void finish(inout ContactRecord record, Sums s, uint first) {
  uint unused = 0, unused_c = 0, pairs = 0, k = 0;
  weigh_words(s.n.even, s.n.odd, first, record.area, record.sum_c, record.sum_cc);
  weigh_words(s.k1.even, s.k1.odd, first, k, record.sum_ck, unused);
  weigh_words(s.k2.even, s.k2.odd, first, pairs, unused_c, unused);
  record.sum_k += k;
  record.sum_kk += 2 * pairs - k;  // k2 sums k (k + 1) / 2
  uint gray = 0;
#ifdef WIDE
  weigh(s.gray.even % kGrayBase, first, gray, record.gray_c_low, unused);
  weigh(s.gray.odd % kGrayBase, first + 1, gray, record.gray_c_low, unused);
  weigh(s.gray.even / kGrayBase, first, gray, record.gray_c_high, unused);
  weigh(s.gray.odd / kGrayBase, first + 1, gray, record.gray_c_high, unused);
#else
  weigh(s.gray_low.even, first, gray, record.gray_c_low, unused);
  weigh(s.gray_low.odd, first + 1, gray, record.gray_c_low, unused);
  weigh(s.gray_high.even, first + 2, gray, record.gray_c_low, unused);
  weigh(s.gray_high.odd, first + 3, gray, record.gray_c_low, unused);
#endif
  record.peak = max(record.peak, max4(s.peak));
  weigh_words(s.saturated.even, s.saturated.odd, first, record.saturated, unused_c, unused);
}

void main() {
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles_x * push.tiles_y) return;
  uint tile_x = tile % push.tiles_x;
  int y0 = int(tile / push.tiles_x * TILE_ROWS);
  int height = int(push.height);
  Sums a = start(2 * tile_x * TEXEL_COLUMNS), b = start((2 * tile_x + 1) * TEXEL_COLUMNS);
  uint g_low = 0, g_high = 0, gk_low = 0, gk_high = 0;

  for (int i = 0; i < 4; ++i) {
    Row r = fetch_row(tile_x, y0 - 2 + i);
    filter_down(a.even, r.a.even);
    filter_down(a.odd, r.a.odd);
    filter_down(b.even, r.b.even);
    filter_down(b.odd, r.b.odd);
    // Of these four rows the last two belong to the tile.
    uint counts = (i >= 2 && y0 - 2 + i < height) ? ONES : 0u;
    count_saturated(a, r.raw_a, counts);
    count_saturated(b, r.raw_b, counts);
  }

  for (int i = 0; i < int(TILE_ROWS); ++i) {
    int y = y0 + i;
    Row r = fetch_row(tile_x, y + 2);
    Half v_a = Half(filter_down(a.even, r.a.even), filter_down(a.odd, r.a.odd));
    Half v_b = Half(filter_down(b.even, r.b.even), filter_down(b.odd, r.b.odd));
    uint counts = (i + 2 < int(TILE_ROWS) && y + 2 < height) ? ONES : 0u;
    count_saturated(a, r.raw_a, counts);
    count_saturated(b, r.raw_b, counts);
    if (KEEP == 1 && y < height) {
      uint texel = (uint(y) * push.tiles_x + tile_x) * (TEXEL_COLUMNS / 4);
      keep(v_a, texel);
      keep(v_b, texel + TEXEL_COLUMNS / 8);
    }
    uint here = y < height ? ONES : 0u;
    uint row_sum = add_row(a, v_a, here) + add_row(b, v_b, here);
    g_low += row_sum % kGrayBase;
    g_high += row_sum / kGrayBase;
    gk_low += g_low;
    gk_high += g_high;
  }

  ContactRecord record = ContactRecord(0, 0, 0, 0, 0, 0, g_low, g_high, 0, 0, gk_low, gk_high, 0, 0, 0, 0);
  finish(record, a, 0);
  finish(record, b, TEXEL_COLUMNS);
  records[tile] = record;
}
