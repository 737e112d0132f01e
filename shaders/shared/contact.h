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
  uint saturated;  // raw pixels at or above the saturation level, contact or not
  uint unused0;
  uint unused1;
};

struct ContactPush {
  uint width;   // px
  uint height;  // px
  uint pitch;   // texels from one padded row to the next
  uint tiles_x;
  uint tiles_y;
  uint threshold;   // in 1/128 gray levels
  uint saturation;  // gray levels
};

#ifdef __cplusplus
static_assert(sizeof(ContactRecord) == 64);
}  // namespace palpate::shared
#endif
#endif
