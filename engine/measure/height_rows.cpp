#include "engine/measure/height_rows.h"

#include <algorithm>

#include "engine/base/divide_up.h"
#include "engine/base/simd.h"
#include "shaders/shared/cell_change.h"

namespace palpate {
namespace {

constexpr uint32_t kSide = shared::kCellSide;
constexpr uint32_t kCells = 64;  // that are worked on at once
static_assert(kSide == 4);

/// Means of a row of cells.
struct MeansOfRow {
  const float* from;  ///< the first of `rows` rows
  size_t pitch;
  uint32_t rows, width;
  float* means;

  PALPATE_INLINE void run() const {
    float sums[kSide * kCells];
    for (uint32_t first = 0; first < width; first += kSide * kCells) {
      const uint32_t pixels = std::min(width - first, kSide * kCells);
      for (uint32_t x = 0; x < pixels; ++x) sums[x] = from[first + x];
      for (uint32_t y = 1; y < rows; ++y)
        for (uint32_t x = 0; x < pixels; ++x) sums[x] += from[y * pitch + first + x];
      float* to = means + first / kSide;
      const uint32_t whole = pixels / kSide;
      const float share = 1 / static_cast<float>(kSide * rows);
      for (uint32_t c = 0; c < whole; ++c)
        to[c] = (sums[4 * c] + sums[4 * c + 1] + sums[4 * c + 2] + sums[4 * c + 3]) * share;
      if (kSide * whole == pixels) continue;
      float sum = 0;
      for (uint32_t x = kSide * whole; x < pixels; ++x) sum += sums[x];
      to[whole] = sum / static_cast<float>((pixels - kSide * whole) * rows);
    }
  }
};

/// One row of pixels: from the levels of its cells, and of those next to them above or below, which have
/// `share`.
struct OffRow {
  const float *here, *next;
  float share;
  uint32_t cells, width;
  float* heights;

  PALPATE_INLINE float level(uint32_t cell) const { return here[cell] * (1 - share) + next[cell] * share; }

  PALPATE_INLINE void run() const {
    constexpr float kFar = 0.375f, kNear = 0.125f;  // middles of cells lie at 1.5, 5.5, ... px
    constexpr float kShares[kSide] = {kFar, kNear, kNear, kFar};
    float levels[kCells + 2];
    for (uint32_t first = 0; first < cells; first += kCells) {
      const uint32_t count = std::min(kCells, cells - first);
      levels[0] = level(first - std::min(first, 1u));
      for (uint32_t i = 0; i < count; ++i) levels[i + 1] = level(first + i);
      levels[count + 1] = level(std::min(first + count, cells - 1));
      float* to = heights + kSide * first;
      const uint32_t pixels = std::min(width - kSide * first, kSide * count), whole = pixels / kSide;
      for (uint32_t i = 0; i < whole; ++i) {
        const float left = levels[i], middle = levels[i + 1], right = levels[i + 2];
        to[4 * i] -= middle * (1 - kFar) + left * kFar;
        to[4 * i + 1] -= middle * (1 - kNear) + left * kNear;
        to[4 * i + 2] -= middle * (1 - kNear) + right * kNear;
        to[4 * i + 3] -= middle * (1 - kFar) + right * kFar;
      }
      for (uint32_t x = kSide * whole; x < pixels; ++x) {
        const uint32_t of = x / kSide, side = x % kSide;
        to[x] -= levels[of + 1] * (1 - kShares[side]) + levels[side < 2 ? of : of + 2] * kShares[side];
      }
    }
  }
};

}  // namespace

uint32_t cells_along(uint32_t pixels) {
  return divide_up(pixels, kSide);
}

void cell_means(const HeightRows& heights, std::span<float> means) {
  const uint32_t cells_x = cells_along(heights.width);
  for (uint32_t y = 0; y < heights.height; y += kSide)
    run_widest(MeansOfRow{heights.row(y), heights.pitch, std::min(kSide, heights.height - y), heights.width,
                          means.data() + size_t{y / kSide} * cells_x});
}

void take_off(const HeightRows& heights, std::span<const float> levels) {
  const uint32_t cells_x = cells_along(heights.width), cells_y = cells_along(heights.height);
  for (uint32_t y = 0; y < heights.height; ++y) {
    const uint32_t cell = y / kSide, side = y % kSide;
    const uint32_t next = side < 2 ? cell - std::min(cell, 1u) : std::min(cell + 1, cells_y - 1);
    run_widest(OffRow{levels.data() + size_t{cell} * cells_x, levels.data() + size_t{next} * cells_x,
                      side == 0 || side == 3 ? 0.375f : 0.125f, cells_x, heights.width, heights.row(y)});
  }
}

}  // namespace palpate
