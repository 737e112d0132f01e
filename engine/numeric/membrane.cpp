#include "engine/numeric/membrane.h"

#include <algorithm>
#include <cassert>

namespace palpate {
namespace {

constexpr int kSweeps = 20;
constexpr int kCoarsestSweeps = 60;

}  // namespace

Membrane::Membrane(uint32_t width, uint32_t height) {
  while (true) {
    const size_t cells = size_t{width} * height;
    levels_.push_back(
        {width, height, std::vector<float>(cells), std::vector<uint8_t>(cells), std::vector<Run>(height)});
    if (width <= 2 && height <= 2) return;
    width = (width + 1) / 2;
    height = (height + 1) / 2;
  }
}

void Membrane::fill(std::span<float> values, std::span<const uint8_t> known) {
  Level& finest = levels_.front();
  assert(values.size() == finest.values.size() && known.size() == values.size());
  if (std::ranges::all_of(known, [](uint8_t k) { return k == 0; })) return;
  std::ranges::copy(values, finest.values.begin());
  std::ranges::copy(known, finest.known.begin());
  for (size_t l = 0; l + 1 < levels_.size(); ++l) restrict_to(levels_[l], levels_[l + 1]);
  // The coarsest has at least one known cell; the others begin with its mean.
  Level& last = levels_.back();
  float sum = 0, count = 0;
  for (size_t i = 0; i < last.values.size(); ++i)
    if (last.known[i] != 0) sum += last.values[i], count += 1;
  for (size_t i = 0; i < last.values.size(); ++i)
    if (last.known[i] == 0) last.values[i] = sum / count;
  for (Level& level : levels_) find_unknown(level);
  sweep(last, kCoarsestSweeps);
  for (size_t l = levels_.size() - 1; l-- > 0;) {
    interpolate(levels_[l + 1], levels_[l]);
    sweep(levels_[l], kSweeps);
  }
  std::ranges::copy(finest.values, values.begin());
}

void Membrane::find_unknown(Level& level) {
  const auto unknown = [](uint8_t known) { return known == 0; };
  for (uint32_t y = 0; y < level.height; ++y) {
    const auto row = level.known.begin() + static_cast<std::ptrdiff_t>(size_t{y} * level.width);
    const auto end = row + level.width, first = std::find_if(row, end, unknown);
    const auto last =
        std::find_if(std::make_reverse_iterator(end), std::make_reverse_iterator(first), unknown);
    level.unknown[y] = {static_cast<uint32_t>(first - row), static_cast<uint32_t>(last.base() - row)};
  }
}

// Means of the known cells.
void Membrane::restrict_to(const Level& fine, Level& coarse) {
  for (uint32_t y = 0; y < coarse.height; ++y)
    for (uint32_t x = 0; x < coarse.width; ++x) {
      float sum = 0, count = 0;
      for (uint32_t v = 2 * y; v < std::min(2 * y + 2, fine.height); ++v)
        for (uint32_t u = 2 * x; u < std::min(2 * x + 2, fine.width); ++u) {
          const size_t cell = size_t{v} * fine.width + u;
          if (fine.known[cell] != 0) sum += fine.values[cell], count += 1;
        }
      const size_t to = size_t{y} * coarse.width + x;
      coarse.known[to] = count > 0;
      coarse.values[to] = count > 0 ? sum / count : 0;
    }
}

void Membrane::interpolate(const Level& coarse, Level& fine) {
  const auto at = [&](int64_t x, int64_t y) {
    x = std::clamp<int64_t>(x, 0, int64_t{coarse.width} - 1);
    y = std::clamp<int64_t>(y, 0, int64_t{coarse.height} - 1);
    return coarse.values[static_cast<size_t>(y) * coarse.width + static_cast<size_t>(x)];
  };
  for (uint32_t y = 0; y < fine.height; ++y)
    for (uint32_t x = fine.unknown[y].begin; x < fine.unknown[y].end; ++x) {
      const size_t cell = size_t{y} * fine.width + x;
      if (fine.known[cell] != 0) continue;
      const int64_t u = x / 2, v = y / 2, u2 = x % 2 == 0 ? u - 1 : u + 1, v2 = y % 2 == 0 ? v - 1 : v + 1;
      fine.values[cell] = (9 * at(u, v) + 3 * at(u2, v) + 3 * at(u, v2) + at(u2, v2)) / 16;
    }
}

void Membrane::sweep(Level& level, int count) {
  for (int pass = 0; pass < count; ++pass)
    for (uint32_t y = 0; y < level.height; ++y) {
      const Run& run = level.unknown[y];
      const bool inside = y > 0 && y + 1 < level.height;
      const uint32_t first = std::max(run.begin, 1u), last = std::min(run.end, level.width - 1);
      if (!inside || first >= last) {
        for (uint32_t x = run.begin; x < run.end; ++x) relax(level, x, y);
        continue;
      }
      if (run.begin < first) relax(level, run.begin, y);
      float* const row = level.values.data() + size_t{y} * level.width;
      const uint8_t* const known = level.known.data() + size_t{y} * level.width;
      const float *const above = row - level.width, *const below = row + level.width;
      // The neighbour on the left is the last to be ready.
      for (uint32_t x = first; x < last; ++x)
        if (known[x] == 0) row[x] = 0.25f * (above[x] + below[x] + row[x + 1] + row[x - 1]);
      if (last < run.end) relax(level, last, y);
    }
}

void Membrane::relax(Level& level, uint32_t x, uint32_t y) {
  const uint32_t width = level.width;
  const size_t cell = size_t{y} * width + x;
  if (level.known[cell] != 0) return;
  float sum = 0, neighbours = 0;
  if (x > 0) sum += level.values[cell - 1], neighbours += 1;
  if (x + 1 < width) sum += level.values[cell + 1], neighbours += 1;
  if (y > 0) sum += level.values[cell - width], neighbours += 1;
  if (y + 1 < level.height) sum += level.values[cell + width], neighbours += 1;
  if (neighbours > 0) level.values[cell] = sum / neighbours;
}

}  // namespace palpate
