// Contact stage: what the kernel leaves for each tile, read by GLSL and C++.
#ifndef PALPATE_SHARED_CONTACT_H
#define PALPATE_SHARED_CONTACT_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// Gray sums are split in base kGrayBase so that no 32-bit field can overflow: value = low + kGrayBase * high.
const uint kGrayBase = 4096;
// Column and row sums of a tile fit 16 bits up to this height.
const uint kMaxTileRows = 64;

// Sums over the contact pixels of one tile (two texels of columns wide, up to kMaxTileRows high). c counts
// columns from the tile's left, k counts rows from its bottom (the last row has k = 1), g is filtered gray in
// 1/256 gray levels.
struct ContactRecord {
  uint area;
  uint sum_c;
  uint sum_cc;
  uint sum_k;
  uint sum_kk;
  uint sum_ck;
  uint gray_low;
  uint gray_high;
  uint gray_c_low;
  uint gray_c_high;
  uint gray_k_low;
  uint gray_k_high;
  uint peak;       // largest g of the contact pixels
  uint saturated;  // raw pixels that touch has brought to the saturation level, contact or not
  uint border;     // not 0: contact pixels in the frame's outermost rows or columns
  uint unused;
};

struct ContactPush {
  uint width;   // px
  uint height;  // px
  uint pitch;   // texels from one padded row to the next
  uint tiles_x;
  uint tiles_y;
  uint threshold;   // in 1/128 gray levels
  uint saturation;  // gray levels
  uint dead;        // gray levels: saturation of pixels that reach this untouched means nothing
  uint parts;       // room in the list of a tile's parts, for the kernels that sum those
};

#ifdef __cplusplus
static_assert(sizeof(ContactRecord) == 64);

// No 32-bit field of a record can overflow, nor any lane on the way: each line is what the largest tile holds
// with every pixel white and in contact. With 8 bits a tile is 32 columns wide and a lane of the kernel has
// 16 bits; above it is 16 columns wide and a lane has 32.
namespace bounds {
constexpr uint64_t kMax = 0xffffffff, kMaxLane = 0xffff;
constexpr uint64_t ones(uint64_t n) {
  return n * (n + 1) / 2;
}  // 1 + 2 + ... + n
constexpr uint64_t squares(uint64_t n) {
  return n * (n + 1) * (2 * n + 1) / 6;
}  // 1 + 4 + ... + n^2
constexpr uint64_t kRows = kMaxTileRows, kColumns8 = 32, kColumns16 = 16;
constexpr uint64_t kGray8 = 255 * 256, kGray16 = 65535 * 256;  // filtered, 1/256 gray levels
// Lanes of 8-bit pixels: the filter's weights sum to 16 each way, so that a filtered pixel fills a lane and
// no more.
static_assert(kGray8 <= kMaxLane);
// Area and its moments, over the wider tile.
static_assert(kColumns8 * kRows <= kMax && kRows * squares(kColumns8 - 1) <= kMax &&
              kColumns8 * squares(kRows) <= kMax && ones(kRows) * ones(kColumns8 - 1) <= kMax);
// Gray of 8 bits, without any split: all columns' weighted with their index; one kind of lane, low or high,
// over the tile's eight words to a row, even and odd, weighted with 1 to 8.
static_assert(kRows * kGray8 * ones(kColumns8 - 1) <= kMax && kRows * 2 * kGray8 * ones(8) <= kMax);
// Gray above 8 bits: one column's sum and one row's fit as they are; what is weighted is split in base
// kGrayBase.
static_assert(kRows * kGray16 <= kMax && kColumns16 * kGray16 <= kMax);
static_assert((kGrayBase - 1) * ones(kColumns16 - 1) <= kMax &&
              (kRows * kGray16 / kGrayBase + 1) * ones(kColumns16 - 1) <= kMax);
// Rows, weighted with k: the low and the high part of a row's sum.
static_assert((kGrayBase - 1) * ones(kRows) <= kMax &&
              (kColumns16 * kGray16 / kGrayBase + 1) * ones(kRows) <= kMax &&
              (kColumns8 * kGray8 / kGrayBase + 1) * ones(kRows) <= kMax);
// Marks of contact and, in contact_moments.comp, gray: four 8-bit pixels to a word, eight words to a row of
// the tile (two and eight above 8 bits). Bytes: a column's count of rows; a row's count in one byte position,
// over its words, and weighted by 1 to 8; a row's whole count, the same over the four positions.
static_assert(kRows <= 255 && 8 <= 255 && 4 * ones(8) <= 255 && 8 * ones(3) <= 255);
// Lanes of 16 bits: a column's gray levels; a row's, of even and odd bytes together.
static_assert(kRows * 255 <= kMaxLane && 2 * 8 * 255 <= kMaxLane);
// Gray levels of the tile, plain, weighted with c and with k.
static_assert(kColumns8 * kRows * 255 <= kMax && kRows * 255 * ones(kColumns8 - 1) <= kMax &&
              kColumns8 * 255 * ones(kRows) <= kMax);
}  // namespace bounds
}  // namespace palpate::shared
#endif
#endif
