// Cell changes by plain loops.
#pragma once

#include <vector>

#include "palpate/frame.h"
#include "shaders/shared/cell_change.h"

namespace palpate::reference {

inline std::vector<shared::CellChange> cell_changes(const Frame& image, const Frame& rest) {
  const uint32_t width = image.format.width, height = image.format.height, side = shared::kCellSide;
  const uint32_t cells_x = (width + side - 1) / side, cells_y = (height + side - 1) / side;
  std::vector<shared::CellChange> cells(size_t{cells_x} * cells_y);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      shared::CellChange& cell = cells[size_t{y / side} * cells_x + x / side];
      const auto change = [&](uint32_t colour) {
        return static_cast<int>(image.at(colour, x, y)) - static_cast<int>(rest.at(colour, x, y));
      };
      cell.red += change(0);
      cell.green += change(1);
      cell.blue += change(2);
      cell.red_squares += static_cast<uint32_t>(change(0) * change(0));
      cell.green_squares += static_cast<uint32_t>(change(1) * change(1));
      cell.blue_squares += static_cast<uint32_t>(change(2) * change(2));
    }
  return cells;
}

}  // namespace palpate::reference
