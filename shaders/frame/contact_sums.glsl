// What the contact kernels share: a texel's pixels in lanes, their change from the untouched image, and the sums over the contact.
// Includes define WIDE (16-bit pixels) or not, and have SIGNAL, SUBTRACT and `push` declared. Everything is integer, so the sums
// are exact and the same on every device.

// A register word holds two pixels of 8 bits in 16-bit lanes (even pixels p0 p2, odd pixels p1 p3), or one pixel of 16 bits in
// 32 (even p0, odd p1). `even` and `odd` are four words each: 16 or 8 neighbouring pixels.
#ifdef WIDE
const uint ONES = 0x00000001u;
const uint TEXEL_COLUMNS = 8u;
const uint WORD_COLUMNS = 2u;
uint even_of(uint w) { return w & 0xffffu; }
uint odd_of(uint w) { return w >> 16; }
uvec4 even_of(uvec4 w) { return w & 0xffffu; }
uvec4 odd_of(uvec4 w) { return w >> 16; }
uvec4 above(uvec4 a, uvec4 b) { return a - min(a, b); }
uvec4 at_least(uvec4 v, uint limit) { return uvec4(greaterThanEqual(v, uvec4(limit))); }
#else
const uint ONES = 0x00010001u;
const uint TEXEL_COLUMNS = 16u;
const uint WORD_COLUMNS = 4u;
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

// Lanes of column sums -> contributions weighted with the column index. `first` is the column of word 0's low lane.
void weigh(uvec4 lanes, uint first, inout uint by_column, inout uint by_square) {
  uvec4 column = uvec4(0, 1, 2, 3) * WORD_COLUMNS + first;
  by_column += sum4(lanes * column);
  by_square += sum4(lanes * column * column);
}

// 1 in every byte whose column lies inside the image; `column` is that of word 0's first pixel.
uvec4 inside(uint column) {
  uvec4 columns = uvec4(0, 1, 2, 3) * WORD_COLUMNS + column, mask = uvec4(0);
  for (uint i = 0; i < WORD_COLUMNS; ++i) mask |= uvec4(lessThan(columns + i, uvec4(push.width))) << (8 * i);
  return mask;
}

// What one texel gathers on its way down. Marks of contact are bytes, a word's pixels in order.
struct Sums {
  uvec4 inside;
  uvec4 saturated;  // what any row had, see saturated_of
  uvec4 count;      // each column's contact pixels
#ifdef WIDE
  Half gray;
  uvec4 peak;
#else
  uvec4 peak_low, peak_high;  // of low lanes, moved up, and of words, whose high lanes decide
#endif
};

// What the tile gathers over all its words. A word of 8-bit pixels' gray is the low lane's plus 2^16 times the high one's, modulo
// 2^32; the high ones are also summed alone, so that both can be told apart.
struct Whole {
  uint area, k, pairs, c, ck;
  uint gray_low, gray_high, gray_k_low, gray_k_high;  // in base kGrayBase
#ifndef WIDE
  uvec2 gray, gray_words, gray_odd;  // all, weighted with 1 to 8 from the left, of odd pixels
#endif
};

// A row's sums over its words; `count_words` weighs them by 1, 2, ... from the left.
struct Row {
  uint count, count_words;
  uvec2 gray;
};
Row start_row() { return Row(0, 0, uvec2(0)); }

Sums start(uint column) {
  const uvec4 zero = uvec4(0);
#ifdef WIDE
  return Sums(inside(column), zero, zero, Half(zero, zero), zero);
#else
  return Sums(inside(column), zero, zero, zero, zero);
#endif
}
Whole start_whole() {
#ifdef WIDE
  return Whole(0, 0, 0, 0, 0, 0, 0, 0, 0);
#else
  return Whole(0, 0, 0, 0, 0, 0, 0, 0, 0, uvec2(0), uvec2(0), uvec2(0));
#endif
}

// In each lane a bit, kSaturatedShift up, that the raw pixel is saturated.
#ifdef WIDE
const uint kSaturatedShift = 0;
uvec4 reaching(uvec4 raw, uint limit) { return at_least(raw, limit); }
#else
const uint kSaturatedShift = 15;
uvec4 reaching(uvec4 raw, uint limit) { return raw + (0x8000u - min(limit, 0x8000u)) * ONES; }
#endif
uvec4 saturated_of(uvec4 raw) { return reaching(raw, push.saturation); }
uvec4 dead_of(uvec4 rest) { return reaching(rest, push.dead); }

// Saturated pixels are rare: rows only mark that there is one, and tiles without any make no turn of the loop that counts them.
bool any_saturated(Sums s) {
  uvec4 any = (s.saturated >> kSaturatedShift) & ONES;
  return (any.x | any.y | any.z | any.w) != 0;
}
uint count_saturated(Sums s, int at) {
  Half raw = Half(uvec4(0), uvec4(0)), untouched = raw;
  for (int plane = 0; plane < PLANES; ++plane) {
    int from = plane * int(push.height) * int(push.pitch) + at;
    uvec4 image = texelFetch(frame_texels, from), rest = texelFetch(rest_texels, from);
    raise(raw, Half(even_of(image), odd_of(image)));
    raise(untouched, Half(even_of(rest), odd_of(rest)));
  }
  uvec4 even = saturated_of(raw.even), odd = saturated_of(raw.odd);
  if (SUBTRACT == 1) {
    even &= ~dead_of(untouched.even);
    odd &= ~dead_of(untouched.odd);
  }
  uvec4 full = ((even >> kSaturatedShift) & s.inside & ONES) + ((odd >> kSaturatedShift) & (s.inside >> 8) & ONES);
  uint sum = sum4(full);
#ifndef WIDE
  sum = (sum & 0xffffu) + (sum >> 16);
#endif
  return sum;
}
void notice_saturated(inout Sums s, Half raw) { s.saturated |= saturated_of(raw.even) | saturated_of(raw.odd); }

// Marks of a texel's pixels, a byte each, as bits from the left, and the other way round.
#ifdef WIDE
uvec4 bits_of(uvec4 one) { return (one | (one >> 7)) & 3u; }
uvec4 marks_of(uvec4 bits) { return (bits | (bits << 7)) & 0x0101u; }
#else
uvec4 bits_of(uvec4 one) { return (one * 0x10204080u) >> 28; }
uvec4 marks_of(uvec4 bits) { return (bits * 0x00204081u) & 0x01010101u; }
#endif
uint pack(uvec4 one) {
  uvec4 bits = bits_of(one);
  return bits.x | (bits.y << WORD_COLUMNS) | (bits.z << 2 * WORD_COLUMNS) | (bits.w << 3 * WORD_COLUMNS);
}
uvec4 unpack(uint bits) { return marks_of((uvec4(bits) >> (uvec4(0, 1, 2, 3) * WORD_COLUMNS)) & ((1u << WORD_COLUMNS) - 1)); }

// Adds one texel of a filtered row, nothing of a row outside the image; texels come from right to left. Returns the marks of its
// contact pixels.
uvec4 add(inout Sums s, inout Whole whole, inout Row row, Half v, bool here) {
#ifdef WIDE
  uint limit = here ? push.threshold * 2 : 0xffffffffu;
  uvec4 even = at_least(v.even, limit) & s.inside, odd = at_least(v.odd, limit) & (s.inside >> 8);
  v.even *= even;
  v.odd *= odd;
  uvec4 one = even | (odd << 8);
  s.gray.even += v.even;
  s.gray.odd += v.odd;
  s.peak = max(s.peak, max(v.even, v.odd));
  row.gray.x += sum4(v.even + v.odd);
#else
  uint reach = here ? (0x8000u - push.threshold) * ONES : 0u;  // adding it carries into bit 15 from the threshold on
  uvec4 even = ((((v.even >> 1) & 0x7fff7fffu) + reach) >> 15) & s.inside & ONES;
  uvec4 odd = ((((v.odd >> 1) & 0x7fff7fffu) + reach) >> 7) & s.inside & (ONES << 8);
  v.even &= (even << 16) - even;
  v.odd &= (odd << 8) - (odd >> 8);
  uvec4 one = even | odd;
  s.peak_high = max(s.peak_high, max(v.even, v.odd));
  s.peak_low = max(s.peak_low, max(v.even << 16, v.odd << 16));
  uvec4 odd_high = v.odd >> 16;
  uvec4 gray = v.even + v.odd, high = (v.even >> 16) + odd_high;
  whole.gray_odd += uvec2(sum4(v.odd), sum4(odd_high));
  for (int i = 3; i >= 0; --i) {
    row.gray += uvec2(gray[i], high[i]);
    whole.gray_words += row.gray;
  }
#endif
  s.count += one;
  for (int i = 3; i >= 0; --i) {
    row.count += one[i];
    row.count_words += row.count;
  }
  return one;
}

uint sum_bytes(uint w) { return (w * 0x01010101u) >> 24; }

// Adds a whole row. Rows are weighted by sums of sums: each adds once for itself and for each row below.
void add_row(inout Whole whole, Row row) {
  uint count = sum_bytes(row.count);
  whole.area += count;
  whole.k += whole.area;
  whole.pairs += whole.k;
  whole.c += WORD_COLUMNS * (sum_bytes(row.count_words) - count) + ((row.count * 0x00010203u) >> 24);
  whole.ck += whole.c;
#ifdef WIDE
  uint gray = row.gray.x;
#else
  whole.gray += row.gray;
  uint gray = row.gray.x - (row.gray.y << 16) + row.gray.y;
#endif
  whole.gray_low += gray % kGrayBase;
  whole.gray_high += gray / kGrayBase;
  whole.gray_k_low += whole.gray_low;
  whole.gray_k_high += whole.gray_high;
}

uint peak_of(Sums s) {
#ifdef WIDE
  return max4(s.peak);
#else
  return max(max4(s.peak_low), max4(s.peak_high)) >> 16;
#endif
}

// The tile's record but for its saturated pixels; a and b are its texels.
ContactRecord record_of(Whole whole, Sums a, Sums b) {
  uint unused = 0, sum_cc = 0, gray_c_low = 0, gray_c_high = 0;
  for (uint i = 0; i < WORD_COLUMNS; ++i) {
    weigh((a.count >> (8 * i)) & 0xffu, i, unused, sum_cc);
    weigh((b.count >> (8 * i)) & 0xffu, i + TEXEL_COLUMNS, unused, sum_cc);
  }
#ifdef WIDE
  weigh(a.gray.even % kGrayBase, 0, gray_c_low, unused);
  weigh(a.gray.odd % kGrayBase, 1, gray_c_low, unused);
  weigh(a.gray.even / kGrayBase, 0, gray_c_high, unused);
  weigh(a.gray.odd / kGrayBase, 1, gray_c_high, unused);
  weigh(b.gray.even % kGrayBase, TEXEL_COLUMNS, gray_c_low, unused);
  weigh(b.gray.odd % kGrayBase, TEXEL_COLUMNS + 1, gray_c_low, unused);
  weigh(b.gray.even / kGrayBase, TEXEL_COLUMNS, gray_c_high, unused);
  weigh(b.gray.odd / kGrayBase, TEXEL_COLUMNS + 1, gray_c_high, unused);
#else
  whole.gray_words -= whole.gray;  // from 0
  gray_c_low = 4 * (whole.gray_words.x - (whole.gray_words.y << 16) + whole.gray_words.y) + 2 * whole.gray.y +
               whole.gray_odd.x - (whole.gray_odd.y << 16) + whole.gray_odd.y;
#endif
  return ContactRecord(whole.area, whole.c, sum_cc, whole.k, 2 * whole.pairs - whole.k, whole.ck, whole.gray_low, whole.gray_high,
                       gray_c_low, gray_c_high, whole.gray_k_low, whole.gray_k_high, max(peak_of(a), peak_of(b)), 0, 0, 0);
}

// Whether the tile that begins in `column` counts pixels in the image's first or last column.
bool at_sides(uint column, Sums a, Sums b) {
  uvec4 last_a = a.count & ((a.inside & ~inside(column + 1)) * 0xffu);
  uvec4 last_b = b.count & ((b.inside & ~inside(column + TEXEL_COLUMNS + 1)) * 0xffu);
  uvec4 last = last_a | last_b;
  return (last.x | last.y | last.z | last.w) != 0 || (column == 0 && (a.count.x & 0xffu) != 0);
}
// As a row's `count`: only of the image's first and last row.
uint at_ends(int y, uint count) { return y == 0 || y == int(push.height) - 1 ? count : 0u; }
