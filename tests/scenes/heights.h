// Ground truth of surface reconstruction; `palpate profile` measures its errors on the same surfaces.
#pragma once

#include "capture/synthetic/heights.h"  // IWYU pragma: export

#include <vector>

namespace palpate::scenes {

inline std::vector<double> heights(const HeightField& field, uint32_t rows, uint32_t cols) {
  std::vector<double> out;
  for (uint32_t y = 0; y < rows; ++y)
    for (uint32_t x = 0; x < cols; ++x) out.push_back(field.height(x, y));
  return out;
}

}  // namespace palpate::scenes
