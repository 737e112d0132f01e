// Height rows: a solved surface in the host's memory, and what is found in it there, so that a frame need not
// go back to the device.
#pragma once

#include <cstdint>
#include <span>

namespace palpate {

/// `height` rows of `width` heights, mm, `pitch` floats apart; beyond the width they hold anything.
struct HeightRows {
  std::span<float> values;
  uint32_t width = 0;
  uint32_t height = 0;
  uint32_t pitch = 0;

  float* row(uint32_t y) const { return values.data() + size_t{y} * pitch; }
};

/// Cells along so many px.
uint32_t cells_along(uint32_t pixels);
/// Mean of each cell of shared::kCellSide px, row by row, the last of a row or column smaller.
void cell_means(const HeightRows& heights, std::span<float> means);
/// Takes a smooth map off, given at the middles of those cells; linear in between, and even beyond them.
void take_off(const HeightRows& heights, std::span<const float> levels);

}  // namespace palpate
