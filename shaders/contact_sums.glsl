// What the contact kernels share: a texel's pixels in lanes, their change from the untouched image, and the sums over the contact.
// Includes define WIDE (16-bit pixels) or not, and have SIGNAL, SUBTRACT and `push` declared. Everything is integer, so the sums
// are exact and the same on every device.

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
#endif

uvec4 change_lanes(uvec4 image, uvec4 rest) {
  if (SUBTRACT == 0) return image;
  if (SIGNAL == 0) return above(image, rest);
  if (SIGNAL == 1) return above(rest, image);
  return above(image, rest) | above(rest, image);
}

// One texel's pixels of a row.
struct Half {
  uvec4 even, odd;
};

Half change(uvec4 image, uvec4 rest) {
  return Half(change_lanes(even_of(image), even_of(rest)), change_lanes(odd_of(image), odd_of(rest)));
}
// The larger of two lanes is a + max(0, b - a).
void raise(inout Half h, Half other) {
  h.even += above(other.even, h.even);
  h.odd += above(other.odd, h.odd);
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
  Half inside;
  uvec4 saturated;  // what any row had, see saturated_of
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
  Half within = Half(inside(column), inside(column + 1));
#ifdef WIDE
  return Sums(within, zero, none, none, none, none, zero);
#else
  return Sums(within, zero, none, none, none, none, none, zero);
#endif
}

// In each lane a bit, kSaturatedShift up, that the raw pixel is saturated.
#ifdef WIDE
const uint kSaturatedShift = 0;
uvec4 saturated_of(uvec4 raw) { return at_least(raw, push.saturation); }
#else
const uint kSaturatedShift = 15;
uvec4 saturated_of(uvec4 raw) { return raw + (0x8000u - min(push.saturation, 0x8000u)) * ONES; }
#endif

// Saturated pixels are rare: rows only tell that there is one, and tiles without any make no turn of the loop that counts them.
bool any_saturated(Sums s) {
  uvec4 any = (s.saturated >> kSaturatedShift) & ONES;
  return (any.x | any.y | any.z | any.w) != 0;
}
uint count_saturated(Sums s, int at) {
  Half raw = Half(uvec4(0), uvec4(0));
  for (int plane = 0; plane < PLANES; ++plane) {
    uvec4 image = texelFetch(frame_texels, plane * int(push.height) * int(push.pitch) + at);
    raise(raw, Half(even_of(image), odd_of(image)));
  }
  uvec4 full = ((saturated_of(raw.even) >> kSaturatedShift) & s.inside.even) + ((saturated_of(raw.odd) >> kSaturatedShift) & s.inside.odd);
  uint sum = sum4(full);
#ifndef WIDE
  sum = (sum & 0xffffu) + (sum >> 16);
#endif
  return sum;
}
void notice_saturated(inout Sums s, Half raw) { s.saturated |= saturated_of(raw.even) | saturated_of(raw.odd); }

// Adds one filtered row, nothing of one that lies outside the image; returns its gray sum.
uint add_row(inout Sums s, Half v, bool here) {
#ifdef WIDE
  uint limit = here ? push.threshold * 2 : 0xffffffffu;
  Half m = Half(at_least(v.even, limit) & s.inside.even, at_least(v.odd, limit) & s.inside.odd);
#else
  uint reach = here ? (0x8000u - push.threshold) * ONES : 0u;  // adding it carries into bit 15 from the threshold on
  Half m = Half(((((v.even >> 1) & 0x7fff7fffu) + reach) >> 15) & s.inside.even,
                ((((v.odd >> 1) & 0x7fff7fffu) + reach) >> 15) & s.inside.odd);
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
}
