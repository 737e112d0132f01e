// Moments alone: frames of 8 bits, gray, that are the change already and are not filtered. Four pixels stay packed in a word;
// what a row adds up to is summed over its words first and unpacked once. One invocation owns the same tile as in contact.comp,
// 32 pixels wide and TILE_ROWS high, and leaves the same record, to the bit.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/contact.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint TILE_ROWS = 32;
layout(constant_id = 4) const uint BRIGHT = 0;  // 1: a threshold of 128 gray levels or more
layout(constant_id = 5) const uint KEEP_MARKS = 0;  // 1: store which pixels are contact

TEXELS(0, uvec4, frame_texels);
layout(binding = 1) writeonly buffer Records { ContactRecord records[]; };
layout(binding = 2) writeonly buffer Marks { uint marks[]; };
layout(push_constant) uniform Push { ContactPush push; };

const int TEXELS = 2;                // of 16 pixels: a tile's width
const uint ONES = 0x01010101u;       // 1 in each byte
const uint EVEN = 0x00ff00ffu;       // bytes 0 and 2
const uint kGrayUnits = 256u;        // of a record's gray to one gray level

uint sum4(uvec4 v) { return v.x + v.y + v.z + v.w; }
uint max4(uvec4 v) { return max(max(v.x, v.y), max(v.z, v.w)); }
uint sum_bytes(uint w) { return (w * ONES) >> 24; }
uint sum_halves(uint w) { return (w & 0xffffu) + (w >> 16); }

// Adding it to the lower seven bits of a byte carries into bit 7 where these reach those of `limit`.
uint reach_of(uint limit) { return (128u - (limit & 127u)) * ONES; }
// Bit 7 of each byte: that the byte is at least the limit, whose own bit 7 is `bright`.
uvec4 at_least(uvec4 v, uint reach, bool bright) {
  uvec4 low = (v & 0x7f7f7f7fu) + reach;
  return bright ? low & v : low | v;
}

// Bit 7 of each byte whose column lies inside the image; `column` is that of the first.
uvec4 inside(uint column) {
  uvec4 columns = uvec4(0, 4, 8, 12) + column, mask = uvec4(0);
  for (uint i = 0; i < 4; ++i) mask |= uvec4(lessThan(columns + i, uvec4(push.width))) * (0x80u << (8 * i));
  return mask;
}

// What one texel gathers on its way down: each column's count of contact pixels and their gray. Sums over whole words hold the
// even bytes' sum plus 256 times the odd bytes', modulo 2^32; the odd ones are also summed alone, so that both can be told apart.
struct Sums {
  uvec4 inside, count, gray, gray_odd;
};

// A row's sums over all its words, lanes as in Sums. `count_words` weighs the words by 1, 2, ... from the left.
struct Row {
  uint count, count_words, gray, gray_odd;
};

// Adds one texel of a row; texels come from right to left. Returns the marks of its contact pixels.
uvec4 add(inout Sums s, inout Row row, uvec4 v, uint reach, uint here) {
  uvec4 hit = at_least(v, reach, BRIGHT == 1) & s.inside & here;
  uvec4 one = hit >> 7;
  uvec4 gray = v & ((hit << 1) - one), odd = (gray >> 8) & EVEN;
  s.count += one;
  s.gray += gray;
  s.gray_odd += odd;
  row.gray += sum4(gray);
  row.gray_odd += sum4(odd);
  for (int i = 3; i >= 0; --i) {
    row.count += one[i];
    row.count_words += row.count;
  }
  return one;
}

// A texel's marks as bits from the left.
uint pack(uvec4 one) {
  uvec4 bits = (one * 0x10204080u) >> 28;
  return bits.x | (bits.y << 4) | (bits.z << 8) | (bits.w << 12);
}

// Adds bytes 0 and 2 (`even`), 1 and 3 (`odd`) of a texel's column sums, weighted with the column and its square.
void weigh(uvec4 even, uvec4 odd, uint first, inout uint by_column, inout uint by_square) {
  uvec4 lanes[4] = uvec4[](even & 0xffffu, odd & 0xffffu, even >> 16, odd >> 16);
  for (uint i = 0; i < 4; ++i) {
    uvec4 column = uvec4(0, 4, 8, 12) + first + i;
    by_column += sum4(lanes[i] * column);
    by_square += sum4(lanes[i] * column * column);
  }
}

void main() {
  uint tile = gl_GlobalInvocationID.x;
  if (tile >= push.tiles_x * push.tiles_y) return;
  int tile_x = int(tile % push.tiles_x);
  int y0 = int(tile / push.tiles_x * TILE_ROWS);
  int height = int(push.height);
  int left = TEXELS * tile_x + 1;
  uint limit = (push.threshold + 127u) / 128u, reach = reach_of(limit);  // gray levels
  Sums s[TEXELS];
  for (int t = 0; t < TEXELS; ++t) s[t] = Sums(inside(uint(TEXELS * tile_x + t) * 16), uvec4(0), uvec4(0), uvec4(0));
  uvec4 brightest = uvec4(0);  // of each byte, in the word's highest one
  uint area = 0, sum_k = 0, pairs = 0, sum_c = 0, sum_ck = 0, gray = 0, gray_k = 0, ends = 0;

  // Heights are even, and two rows to a turn keep more in registers.
  for (int i = 0; i < int(TILE_ROWS); i += 2) for (int j = 0; j < 2; ++j) {
    int y = y0 + i + j;
    uint here = y < height ? 0xffffffffu : 0u;
    // Below the frame the last row is read again, as padding repeats the last column: neither is brighter than the frame.
    int at = min(y, height - 1) * int(push.pitch) + left;
    Row row = Row(0, 0, 0, 0);
    uint marked = 0;
    for (int t = TEXELS - 1; t >= 0; --t) {
      uvec4 v = texelFetch(frame_texels, at + t);
      for (int w = 0; w < 4; ++w) brightest = max(brightest, uvec4(v[w] << 24, v[w] << 16, v[w] << 8, v[w]));
      marked = (marked << 16) | pack(add(s[t], row, v, reach, here));
    }
    if (KEEP_MARKS == 1) marks[tile * TILE_ROWS + i + j] = marked;
    ends |= y == 0 || y == height - 1 ? row.count : 0u;
    // Rows are weighted by sums of sums: each adds once for itself and for each row below.
    uint count = sum_bytes(row.count);
    area += count;
    sum_k += area;
    pairs += sum_k;
    sum_c += 4 * (sum_bytes(row.count_words) - count) + ((row.count * 0x00010203u) >> 24);
    sum_ck += sum_c;
    gray += sum_halves(row.gray - (row.gray_odd << 8) + row.gray_odd);
    gray_k += gray;
  }

  uint unused = 0, sum_cc = 0, gray_c = 0;
  for (int t = 0; t < TEXELS; ++t) {
    weigh(s[t].count & EVEN, (s[t].count >> 8) & EVEN, 16 * t, unused, sum_cc);
    weigh(s[t].gray - (s[t].gray_odd << 8), s[t].gray_odd, 16 * t, gray_c, unused);
  }
  uvec4 last = uvec4(0);  // columns' counts in the image's last one
  for (int t = 0; t < TEXELS; ++t)
    last |= s[t].count & (((s[t].inside & ~inside(uint(TEXELS * tile_x + t) * 16 + 1)) >> 7) * 0xffu);
  bool sides = (last.x | last.y | last.z | last.w) != 0 || (tile_x == 0 && (s[0].count.x & 0xffu) != 0);

  // Without a filter the brightest pixel of all is the brightest of the contact, if it belongs to it.
  uint top = max4(brightest) >> 24, peak = top >= limit ? top * kGrayUnits : 0;

  // Saturated pixels are rare, so that most tiles make no turn here.
  uint saturated = 0, full = reach_of(push.saturation);
  int rows = top >= push.saturation ? min(int(TILE_ROWS), height - y0) : 0;
  for (int i = 0; i < rows; ++i) {
    for (int t = 0; t < TEXELS; ++t) {
      uvec4 v = texelFetch(frame_texels, (y0 + i) * int(push.pitch) + left + t);
      saturated += sum_bytes(sum4((at_least(v, full, push.saturation >= 128u) & s[t].inside) >> 7));
    }
  }
  const uint base = kGrayBase / kGrayUnits;
  records[tile] = ContactRecord(area, sum_c, sum_cc, sum_k, 2 * pairs - sum_k, sum_ck, gray % base * kGrayUnits, gray / base,
                                gray_c % base * kGrayUnits, gray_c / base, gray_k % base * kGrayUnits, gray_k / base, peak,
                                saturated, ends != 0 || sides ? 1 : 0, 0);
}
