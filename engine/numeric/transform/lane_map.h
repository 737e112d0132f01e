// A map whose lines along either axis can be had sixteen at a time: blocks of 16 columns, one below the
// other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/base/divide_up.h"
#include "engine/numeric/transform/lane_fft.h"

namespace palpate {

class LaneMap {
 public:
  static constexpr uint32_t kSide = 2 * kLaneCount;

  LaneMap(uint32_t width, uint32_t height)
      : width_(width),
        padded_height_(divide_up(height, kSide) * kSide),
        values_(size_t{divide_up(width, kSide)} * padded_height_) {}

  uint32_t column_blocks() const { return divide_up(width_, kSide); }
  uint32_t row_blocks() const { return padded_height_ / kSide; }

  /// Columns from 16 `block` on: one row of the map after the other.
  LaneRow* columns(uint32_t block) { return values_.data() + size_t{block} * padded_height_; }

  /// Rows from 16 `block` on: to[place(x)] gets what all sixteen hold at x.
  template <typename Place>
  void read_rows(uint32_t block, LaneRow* to, const Place& place) {
    for (uint32_t x = 0; x < width_; ++x) {
      const LaneRow* from = tile(x, block);
      LaneRow& row = to[place(x)];
      for (uint32_t i = 0; i < kSide; ++i) row.values[i] = from[i].values[x % kSide];
    }
  }
  template <typename Place>
  void write_rows(uint32_t block, const LaneRow* from, const Place& place) {
    for (uint32_t x = 0; x < width_; ++x) {
      LaneRow* to = tile(x, block);
      const LaneRow& row = from[place(x)];
      for (uint32_t i = 0; i < kSide; ++i) to[i].values[x % kSide] = row.values[i];
    }
  }

 private:
  LaneRow* tile(uint32_t x, uint32_t block) { return columns(x / kSide) + size_t{block} * kSide; }

  uint32_t width_, padded_height_;
  std::vector<LaneRow> values_;
};

}  // namespace palpate
