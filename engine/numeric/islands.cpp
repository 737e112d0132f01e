#include "engine/numeric/islands.h"

#include <algorithm>
#include <numeric>

namespace palpate {
namespace {

// Known pixels side by side in a row, columns first to last.
struct Run {
  uint32_t y, first, last;
};

uint32_t root(std::vector<uint32_t>& parent, uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

// Runs instead of pixels: a frame has a few for each row, and two rows are joined in one pass over their
// runs.
Islands find_islands(std::span<const uint8_t> known, uint32_t width, uint32_t height,
                     const std::function<bool(uint32_t x, uint32_t y)>& touched,
                     std::vector<uint32_t>* labels) {
  Islands found;
  std::vector<Run> runs;
  std::vector<uint32_t> parent;
  size_t above = 0, row_start = 0;
  for (uint32_t y = 0; y < height; ++y) {
    above = row_start;
    row_start = runs.size();
    const uint8_t* row = known.data() + size_t{y} * width;
    for (uint32_t x = 0; x < width;) {
      if (!row[x]) {
        ++found.unknown_px;
        ++x;
        continue;
      }
      const uint32_t first = x;
      while (x < width && row[x]) ++x;
      runs.push_back({y, first, x - 1});
      parent.push_back(static_cast<uint32_t>(parent.size()));
    }
    for (size_t here = row_start, up = above; here < runs.size() && up < row_start;) {
      if (runs[up].last >= runs[here].first && runs[here].last >= runs[up].first)
        parent[root(parent, static_cast<uint32_t>(here))] = root(parent, static_cast<uint32_t>(up));
      if (runs[up].last < runs[here].last) {
        ++up;
      } else {
        ++here;
      }
    }
  }
  std::vector<uint32_t> number(runs.size(), 0);
  for (uint32_t i = 0; i < runs.size(); ++i)
    if (parent[i] == i) number[i] = ++found.count;
  if (touched) {
    std::vector<uint8_t> has_touch(runs.size(), 0);
    for (uint32_t i = 0; i < runs.size(); ++i) {
      uint8_t& mark = has_touch[root(parent, i)];
      for (uint32_t x = runs[i].first; x <= runs[i].last && !mark; ++x) mark = touched(x, runs[i].y) ? 1 : 0;
    }
    found.touched = static_cast<uint32_t>(std::count(has_touch.begin(), has_touch.end(), uint8_t{1}));
  }
  if (labels) {
    labels->assign(size_t{width} * height, 0);
    for (uint32_t i = 0; i < runs.size(); ++i) {
      const auto row = labels->begin() + static_cast<std::ptrdiff_t>(size_t{runs[i].y} * width);
      std::fill(row + runs[i].first, row + runs[i].last + 1, number[root(parent, i)]);
    }
  }
  return found;
}

}  // namespace palpate
