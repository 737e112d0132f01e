// The contact stage, as contact.comp and contact_unfiltered.comp, for GPUs: a workgroup owns a tile eight words wide (32 pixels of 8
// bits, 16 of 16) and eight rows high, an invocation one word of a row. What a strip keeps in registers lies in shared memory. The
// records are the same to the last bit. Variants: WIDE (16-bit pixels), PLANES (1 or 3), PARTS (a workgroup owns a part that
// regions.comp found in a tile).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared/contact.h"
#include "shaders/shared/regions.h"
#include "shaders/shared/texels.glsl"

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(constant_id = 3) const uint FILTER = 1;      // 0: the change is not filtered
layout(constant_id = 4) const uint SIGNAL = 0;      // 0 brighter, 1 darker, 2 either
layout(constant_id = 5) const uint KEEP = 0;        // 1: store the filtered image
layout(constant_id = 6) const uint KEEP_SHIFT = 0;  // drops fraction bits so that a stored value fits 16 bits
layout(constant_id = 7) const uint SUBTRACT = 1;    // 0: the frame is the change already, the rest image is not read
layout(constant_id = 8) const uint KEEP_MARKS = 0;  // 1: store which pixels are contact

TEXELS(0, uint, frame_words);
TEXELS(1, uint, rest_words);
layout(binding = 2) writeonly buffer Records { ContactRecord records[]; };
#ifdef PARTS
layout(binding = 3) readonly buffer Parts { RegionPart parts[]; };
TEXELS(4, uint, part_marks);
layout(binding = 5) readonly buffer Count { uint part_count; };
#else
layout(binding = 3) writeonly buffer Filtered { uint filtered[]; };
layout(binding = 4) writeonly buffer Marks { uint marks[]; };  // of a tile its rows, a bit a pixel from the left
#endif
layout(push_constant) uniform Push { ContactPush push; };

#include "shaders/frame/tile_words.glsl"

// A word's even and odd pixels: 8-bit pixels in two lanes of 16 bits, 16-bit pixels alone.
#ifdef WIDE
const int kPixels = 2;
uint even_of(uint w) { return w & 0xffffu; }
uint odd_of(uint w) { return w >> 16; }
uint above(uint a, uint b) { return a - min(a, b); }
uint pixel(uint even, uint odd, int i) { return i == 0 ? even : odd; }
#else
const int kPixels = 4;
uint even_of(uint w) { return w & 0x00ff00ffu; }
uint odd_of(uint w) { return (w >> 8) & 0x00ff00ffu; }
// max(0, a - b) in each lane: bit 8 survives the subtraction exactly where a >= b.
uint above(uint a, uint b) {
  uint t = (a | 0x01000100u) - b;
  return t & (((t >> 8) & 0x00010001u) * 0xffu);
}
uint pixel(uint even, uint odd, int i) { return ((i & 1) == 0 ? even : odd) >> (16 * (i >> 1)) & 0xffffu; }
#endif

uint change(uint image, uint rest) {
  if (SUBTRACT == 0) return image;
  if (SIGNAL == 0) return above(image, rest);
  if (SIGNAL == 1) return above(rest, image);
  return above(image, rest) | above(rest, image);
}

shared uint change_even[kWordsRead * kRowsRead], change_odd[kWordsRead * kRowsRead];
shared uint across_even[kWords * kRowsRead], across_odd[kWords * kRowsRead];
const int kSums = 12;
shared uint terms[kSums * kRows * kWords];
shared uint totals[kSums], row_marks[kRows];
shared uint tile_peak, tile_saturated, tile_border;

// Word w of row y in plane 0; w is -1 to kWords.
int word_at(uint tile_x, int w, int y) { return (clamp(y, 0, int(push.height) - 1) * int(push.pitch) + 2 * int(tile_x) + 1) * 4 + w; }
int plane_words() { return int(push.height * push.pitch) * 4; }

void fetch_changes(uint tile_x, int y0) {
  for (int n = int(gl_LocalInvocationIndex); n < kWordsRead * kRowsRead; n += int(gl_WorkGroupSize.x)) {
    int at = word_at(tile_x, n % kWordsRead - 1, y0 + n / kWordsRead - 2);
    uint even = 0, odd = 0;
    for (int plane = 0; plane < PLANES; ++plane, at += plane_words()) {
      uint image = texelFetch(frame_words, at).x, rest = texelFetch(rest_words, at).x;
      // The larger of two is a + max(0, b - a).
      even += above(change(even_of(image), even_of(rest)), even);
      odd += above(change(odd_of(image), odd_of(rest)), odd);
    }
    change_even[n] = even;
    change_odd[n] = odd;
  }
}

// Horizontally with weights 1 4 6 4 1.
void filter_across() {
  for (int n = int(gl_LocalInvocationIndex); n < kWords * kRowsRead; n += int(gl_WorkGroupSize.x)) {
    int at = n / kWords * kWordsRead + n % kWords + 1;
    uvec2 smoothed = binomial(along(change_even[at], change_odd[at], change_even[at - 1], change_even[at + 1], change_odd[at - 1],
                                    change_odd[at + 1]));
    across_even[n] = smoothed.x;
    across_odd[n] = smoothed.y;
  }
}
#define FILTER_DOWN(rows, at) \
  (rows[at] + rows[(at) + 4 * kWords] + ((rows[(at) + kWords] + rows[(at) + 3 * kWords]) << 2) + 6 * rows[(at) + 2 * kWords])

// Which of a word's pixels are saturated by touch, contact or not: a bit each.
uint saturated_bits(int at) {
  uint full = 0;
  for (int i = 0; i < kPixels; ++i) {
    uint seen = 0, untouched = 0;
    for (int plane = 0; plane < PLANES; ++plane) {
      uint image = texelFetch(frame_words, at + plane * plane_words()).x, rest = texelFetch(rest_words, at + plane * plane_words()).x;
      seen = max(seen, pixel(even_of(image), odd_of(image), i));
      untouched = max(untouched, pixel(even_of(rest), odd_of(rest), i));
    }
    bool dead = SUBTRACT == 1 && untouched >= push.dead;
    full |= seen >= push.saturation && !dead ? 1u << i : 0;
  }
  return full;
}

void main() {
#ifdef PARTS
  uint part = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
  bool given = part < min(push.parts, part_count);
  uint tile = given ? parts[part].tile : 0;
#else
  uint tile = gl_WorkGroupID.y * push.tiles_x + gl_WorkGroupID.x;
#endif
  uint tile_x = tile % push.tiles_x;
  int y0 = int(tile / push.tiles_x) * kRows, me = int(gl_LocalInvocationIndex);
  fetch_changes(tile_x, y0);
  if (me < kSums) totals[me] = 0;
  if (me < kRows) row_marks[me] = 0;
  if (me == 0) tile_peak = tile_saturated = tile_border = 0;
  barrier();
  filter_across();
  barrier();

  // This invocation's word: its pixels from the left, weighted by column and, from the bottom, by row.
  int word = me % kWords, row = me / kWords, y = y0 + row;
  int across = row * kWords + word, middle = (row + 2) * kWordsRead + word + 1;
  uint even = FILTER == 1 ? FILTER_DOWN(across_even, across) : change_even[middle] << 8;
  uint odd = FILTER == 1 ? FILTER_DOWN(across_odd, across) : change_odd[middle] << 8;
  int column = (int(tile_x) * kWords + word) * kPixels, height = int(push.height);
  uint inside = y < height ? (1u << clamp(int(push.width) - column, 0, kPixels)) - 1 : 0;
#ifdef PARTS
  bool own_row = given && row >= int(parts[part].first_row) && row <= int(parts[part].last_row);
  inside &= own_row ? texelFetch(part_marks, int(part * kMaxTileRows) + row).x >> (word * kPixels) : 0;
#else
  if (KEEP == 1 && y < height) {
    uint at = ((uint(y) * push.tiles_x + tile_x) * kWords + word) * kPixels / 2;
#ifdef WIDE
    filtered[at] = (even >> KEEP_SHIFT) | ((odd >> KEEP_SHIFT) << 16);
#else
    filtered[at] = (even & 0xffffu) | (odd << 16);
    filtered[at + 1] = (even >> 16) | (odd & 0xffff0000u);
#endif
  }
#endif
  uint s[kSums] = uint[kSums](0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0), bits = 0, peak = 0;
  const uint k = uint(kRows - row);
  for (int i = 0; i < kPixels; ++i) {
    uint g = pixel(even, odd, i), c = uint(word * kPixels + i);
    // Thresholds are in 1/128 gray levels, and 8-bit pixels compare so.
#ifdef WIDE
    bool contact = (inside >> i & 1) == 1 && g >= 2 * push.threshold;
#else
    bool contact = (inside >> i & 1) == 1 && g >> 1 >= push.threshold;
#endif
    uint one = contact ? 1 : 0, low = contact ? g % kGrayBase : 0, high = contact ? g / kGrayBase : 0;
    bits |= one << i;
    peak = max(peak, contact ? g : 0);
    s[0] += one;
    s[1] += one * c;
    s[2] += one * c * c;
    s[6] += low;
    s[7] += high;
    s[8] += low * c;
    s[9] += high * c;
  }
  s[3] = s[0] * k;
  s[4] = s[3] * k;
  s[5] = s[1] * k;
  s[10] = s[6] * k;
  s[11] = s[7] * k;
  for (int i = 0; i < kSums; ++i) terms[i * kRows * kWords + me] = s[i];
  uint full = inside == 0 ? 0 : bitCount(saturated_bits(word_at(tile_x, word, y)) & inside);
  if (full > 0) atomicAdd(tile_saturated, full);
  if (bits != 0) {
    atomicMax(tile_peak, peak);
    atomicOr(row_marks[row], bits << (word * kPixels));
    int last = int(push.width) - 1 - column;
    bool side = (column == 0 && (bits & 1) == 1) || (last < kPixels && (bits >> max(last, 0) & 1) == 1);
    if (side || y == 0 || y == height - 1) tile_border = 1;
  }
  barrier();
  // Four invocations a sum.
  const int kQuarter = kRows * kWords / 4;
  for (int n = me; n < 4 * kSums; n += int(gl_WorkGroupSize.x)) {
    uint sum = 0;
    for (int i = 0; i < kQuarter; ++i) sum += terms[n / 4 * 4 * kQuarter + i * 4 + n % 4];
    atomicAdd(totals[n / 4], sum);
  }
  barrier();
#ifdef PARTS
  if (me == 0 && given)
    records[part] = ContactRecord(totals[0], totals[1], totals[2], totals[3], totals[4], totals[5], totals[6], totals[7], totals[8],
                                  totals[9], totals[10], totals[11], tile_peak, tile_saturated, 0, 0);
#else
  if (me == 0)
    records[tile] = ContactRecord(totals[0], totals[1], totals[2], totals[3], totals[4], totals[5], totals[6], totals[7], totals[8],
                                  totals[9], totals[10], totals[11], tile_peak, tile_saturated, tile_border, 0);
  if (KEEP_MARKS == 1 && me < kRows) marks[tile * kRows + me] = row_marks[me];
#endif
}
