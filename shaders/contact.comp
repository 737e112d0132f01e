// Background subtraction, 5x5 binomial filter, threshold and moments in one pass. Rows stream through registers; one invocation
// owns a tile one texel wide (16 pixels of 8 bits, 8 of 16) and TILE_ROWS high. Everything is integer, so the sums are exact
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
const uint TILE_COLUMNS = 8u;
uint even_of(uint w) { return w & 0xffffu; }
uint odd_of(uint w) { return w >> 16; }
uvec4 even_of(uvec4 w) { return w & 0xffffu; }
uvec4 odd_of(uvec4 w) { return w >> 16; }
uint above(uint a, uint b) { return a - min(a, b); }
uvec4 above(uvec4 a, uvec4 b) { return a - min(a, b); }
uvec4 from_left(uvec4 x, uvec4 left) { return left; }
uvec4 from_right(uvec4 x, uvec4 right) { return right; }
uvec4 at_least(uvec4 v, uint limit) { return uvec4(greaterThanEqual(v, uvec4(limit))); }
#else
const uint ONES = 0x00010001u;
const uint LANE = 0xffffu;
const uint TILE_COLUMNS = 16u;
uint even_of(uint w) { return w & 0x00ff00ffu; }
uint odd_of(uint w) { return (w >> 8) & 0x00ff00ffu; }
uvec4 even_of(uvec4 w) { return w & 0x00ff00ffu; }
uvec4 odd_of(uvec4 w) { return (w >> 8) & 0x00ff00ffu; }
// max(0, a - b) in each lane: bit 8 survives the subtraction exactly where a >= b.
uint above(uint a, uint b) {
  uint t = (a | 0x01000100u) - b;
  return t & (((t >> 8) & ONES) * 0xffu);
}
uvec4 above(uvec4 a, uvec4 b) {
  uvec4 t = (a | 0x01000100u) - b;
  return t & (((t >> 8) & ONES) * 0xffu);
}
uvec4 from_left(uvec4 x, uvec4 left) { return (x << 16) | (left >> 16); }
uvec4 from_right(uvec4 x, uvec4 right) { return (x >> 16) | (right << 16); }
#endif

uint change(uint image, uint rest) {
  if (SIGNAL == 0) return above(image, rest);
  if (SIGNAL == 1) return above(rest, image);
  return above(image, rest) | above(rest, image);
}
uvec4 change(uvec4 image, uvec4 rest) {
  if (SIGNAL == 0) return above(image, rest);
  if (SIGNAL == 1) return above(rest, image);
  return above(image, rest) | above(rest, image);
}

struct Row {
  uvec4 even, odd;          // horizontally filtered, weights 1 4 6 4 1
  uvec4 even_raw, odd_raw;  // brightest plane as the camera sees it, to count saturation
};

Row fetch_row(uint tile_x, int y) {
  int row = clamp(y, 0, int(push.height) - 1);
  uvec4 even = uvec4(0), odd = uvec4(0);
  uint even_l = 0, odd_l = 0, even_r = 0, odd_r = 0;
  Row r;
  r.even_raw = uvec4(0);
  r.odd_raw = uvec4(0);
  for (int plane = 0; plane < PLANES; ++plane) {
    int at = (plane * int(push.height) + row) * int(push.pitch) + int(tile_x) + 1;
    uvec4 image = texelFetch(frame_texels, at), rest = texelFetch(rest_texels, at);
    uint image_l = texelFetch(frame_words, at * 4 - 1).x, rest_l = texelFetch(rest_words, at * 4 - 1).x;
    uint image_r = texelFetch(frame_words, at * 4 + 4).x, rest_r = texelFetch(rest_words, at * 4 + 4).x;
    uvec4 e = change(even_of(image), even_of(rest)), o = change(odd_of(image), odd_of(rest));
    uint el = change(even_of(image_l), even_of(rest_l)), ol = change(odd_of(image_l), odd_of(rest_l));
    uint er = change(even_of(image_r), even_of(rest_r)), or_ = change(odd_of(image_r), odd_of(rest_r));
    if (PLANES == 1) {
      even = e; odd = o; even_l = el; odd_l = ol; even_r = er; odd_r = or_;
      r.even_raw = even_of(image);
      r.odd_raw = odd_of(image);
    } else {  // the larger of two lanes is a + max(0, b - a)
      even += above(e, even);
      odd += above(o, odd);
      even_l += above(el, even_l);
      odd_l += above(ol, odd_l);
      even_r += above(er, even_r);
      odd_r += above(or_, odd_r);
      r.even_raw += above(even_of(image), r.even_raw);
      r.odd_raw += above(odd_of(image), r.odd_raw);
    }
  }
  uvec4 even_2l = from_left(even, uvec4(even_l, even.xyz));
  uvec4 even_2r = from_right(even, uvec4(even.yzw, even_r));
  uvec4 odd_1l = from_left(odd, uvec4(odd_l, odd.xyz));
  uvec4 odd_2r = from_right(odd, uvec4(odd.yzw, odd_r));
  r.even = even_2l + even_2r + ((odd_1l + even + odd) << 2) + (even << 1);
  r.odd = odd_1l + odd_2r + ((even + odd + even_2r) << 2) + (odd << 1);
  return r;
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
void weigh_words(uvec4 even, uvec4 odd, inout uint s0, inout uint s1, inout uint s2) {
#ifdef WIDE
  weigh(even, 0, s0, s1, s2);
  weigh(odd, 1, s0, s1, s2);
#else
  weigh(even & 0xffffu, 0, s0, s1, s2);
  weigh(odd & 0xffffu, 1, s0, s1, s2);
  weigh(even >> 16, 2, s0, s1, s2);
  weigh(odd >> 16, 3, s0, s1, s2);
#endif
}

// 1 in every lane whose column lies inside the image.
uvec4 inside(uint tile_x, uint lane_column) {
#ifdef WIDE
  uvec4 column = uvec4(0, 2, 4, 6) + lane_column + tile_x * TILE_COLUMNS;
  return uvec4(lessThan(column, uvec4(push.width)));
#else
  uvec4 column = uvec4(0, 4, 8, 12) + lane_column + tile_x * TILE_COLUMNS;
  return uvec4(lessThan(column, uvec4(push.width))) | (uvec4(lessThan(column + 2, uvec4(push.width))) << 16);
#endif
}

void main() {
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles_x * push.tiles_y) return;
  uint tile_x = tile % push.tiles_x;
  int y0 = int(tile / push.tiles_x * TILE_ROWS);
  int height = int(push.height);
  uvec4 inside_even = inside(tile_x, 0), inside_odd = inside(tile_x, 1);

#ifndef WIDE
  uint reach = (0x8000u - push.threshold) * ONES;             // adding it carries into bit 15 from the threshold on
  uint full = (0x8000u - min(push.saturation, 0x8000u)) * ONES;
#endif

  Column even_column = Column(uvec4(0), uvec4(0), uvec4(0), uvec4(0));
  Column odd_column = even_column;
  uvec4 saturated_even = uvec4(0), saturated_odd = uvec4(0);
  uvec4 n_even = uvec4(0), n_odd = uvec4(0), k1_even = uvec4(0), k1_odd = uvec4(0), k2_even = uvec4(0), k2_odd = uvec4(0);
#ifdef WIDE
  uvec4 g_even = uvec4(0), g_odd = uvec4(0);
#else
  uvec4 g_even0 = uvec4(0), g_even1 = uvec4(0), g_odd0 = uvec4(0), g_odd1 = uvec4(0);
#endif
  uvec4 peak = uvec4(0);
  uint g_low = 0, g_high = 0, gk_low = 0, gk_high = 0;

  for (int i = 0; i < 4; ++i) {
    Row r = fetch_row(tile_x, y0 - 2 + i);
    filter_down(even_column, r.even);
    filter_down(odd_column, r.odd);
    // Of these four rows the last two belong to the tile.
    uint counts = (i >= 2 && y0 - 2 + i < height) ? ONES : 0u;
#ifdef WIDE
    saturated_even += at_least(r.even_raw, push.saturation) & inside_even & counts;
    saturated_odd += at_least(r.odd_raw, push.saturation) & inside_odd & counts;
#else
    saturated_even += ((r.even_raw + full) >> 15) & inside_even & counts;
    saturated_odd += ((r.odd_raw + full) >> 15) & inside_odd & counts;
#endif
  }

  for (int i = 0; i < int(TILE_ROWS); ++i) {
    int y = y0 + i;
    Row r = fetch_row(tile_x, y + 2);
    uvec4 v_even = filter_down(even_column, r.even);
    uvec4 v_odd = filter_down(odd_column, r.odd);

    uint counts = (i + 2 < int(TILE_ROWS) && y + 2 < height) ? ONES : 0u;
    uint here = y < height ? ONES : 0u;
#ifdef WIDE
    saturated_even += at_least(r.even_raw, push.saturation) & inside_even & counts;
    saturated_odd += at_least(r.odd_raw, push.saturation) & inside_odd & counts;
    uvec4 m_even = at_least(v_even, push.threshold * 2) & inside_even & here;
    uvec4 m_odd = at_least(v_odd, push.threshold * 2) & inside_odd & here;
#else
    saturated_even += ((r.even_raw + full) >> 15) & inside_even & counts;
    saturated_odd += ((r.odd_raw + full) >> 15) & inside_odd & counts;
    uvec4 m_even = ((((v_even >> 1) & 0x7fff7fffu) + reach) >> 15) & inside_even & here;
    uvec4 m_odd = ((((v_odd >> 1) & 0x7fff7fffu) + reach) >> 15) & inside_odd & here;
#endif
    if (KEEP == 1 && y < height) {
      uint at = (uint(y) * push.tiles_x + tile_x) * (TILE_COLUMNS / 8);
#ifdef WIDE
      uvec4 e = v_even >> KEEP_SHIFT, o = v_odd >> KEEP_SHIFT;
      filtered[at] = e | (o << 16);
#else
      uvec4 low = (v_even & 0xffffu) | (v_odd << 16), high = (v_even >> 16) | (v_odd & 0xffff0000u);
      filtered[at] = uvec4(low.x, high.x, low.y, high.y);
      filtered[at + 1] = uvec4(low.z, high.z, low.w, high.w);
#endif
    }

    // Rows are weighted by sums of sums: after the last row a row's mark was added once for each row from it to the bottom.
    n_even += m_even;
    n_odd += m_odd;
    k1_even += n_even;
    k1_odd += n_odd;
    k2_even += k1_even;
    k2_odd += k1_odd;

    v_even &= m_even * LANE;
    v_odd &= m_odd * LANE;
#ifdef WIDE
    g_even += v_even;
    g_odd += v_odd;
    uint row_sum = sum4(v_even + v_odd);
    peak = max(peak, max(v_even, v_odd));
#else
    uvec4 e0 = v_even & 0xffffu, e1 = v_even >> 16, o0 = v_odd & 0xffffu, o1 = v_odd >> 16;
    g_even0 += e0;
    g_even1 += e1;
    g_odd0 += o0;
    g_odd1 += o1;
    uint row_sum = sum4(e0 + e1 + o0 + o1);
    peak = max(peak, max(max(e0, e1), max(o0, o1)));
#endif
    g_low += row_sum % kGrayBase;
    g_high += row_sum / kGrayBase;
    gk_low += g_low;
    gk_high += g_high;
  }

  ContactRecord record;
  record.area = 0;
  record.sum_c = 0;
  record.sum_cc = 0;
  weigh_words(n_even, n_odd, record.area, record.sum_c, record.sum_cc);
  uint pair = 0, unused = 0;
  record.sum_k = 0;
  record.sum_ck = 0;
  weigh_words(k1_even, k1_odd, record.sum_k, record.sum_ck, unused);
  uint unused_c = 0;
  weigh_words(k2_even, k2_odd, pair, unused_c, unused);
  record.sum_kk = 2 * pair - record.sum_k;  // k2 sums k (k + 1) / 2
  record.gray_low = g_low;
  record.gray_high = g_high;
  record.gray_k_low = gk_low;
  record.gray_k_high = gk_high;
  record.gray_c_low = 0;
  record.gray_c_high = 0;
  uint gray = 0;
#ifdef WIDE
  weigh(g_even % kGrayBase, 0, gray, record.gray_c_low, unused);
  weigh(g_odd % kGrayBase, 1, gray, record.gray_c_low, unused);
  weigh(g_even / kGrayBase, 0, gray, record.gray_c_high, unused);
  weigh(g_odd / kGrayBase, 1, gray, record.gray_c_high, unused);
#else
  weigh(g_even0, 0, gray, record.gray_c_low, unused);
  weigh(g_odd0, 1, gray, record.gray_c_low, unused);
  weigh(g_even1, 2, gray, record.gray_c_low, unused);
  weigh(g_odd1, 3, gray, record.gray_c_low, unused);
#endif
  record.peak = max4(peak);
  uint saturated = 0, unused_s = 0;
  weigh_words(saturated_even, saturated_odd, saturated, unused_s, unused);
  record.saturated = saturated;
  record.unused0 = 0;
  record.unused1 = 0;
  records[tile] = record;
}
