#include "engine/numeric/islands.h"

#include <algorithm>

namespace palpate {

uint32_t IslandFinder::root(uint32_t run) {
  while (parent_[run] != run) run = parent_[run] = parent_[parent_[run]];
  return run;
}

// Runs instead of pixels: a frame has a few for each row, and two rows are joined in one pass over their
// runs.
Islands IslandFinder::find(std::span<const uint8_t> known, uint32_t width, uint32_t height,
                           const std::function<bool(uint32_t x, uint32_t y)>& touched,
                           std::vector<uint32_t>* labels) {
  Islands found;
  runs_.clear();
  parent_.clear();
  size_t above = 0, row_start = 0;
  for (uint32_t y = 0; y < height; ++y) {
    above = row_start;
    row_start = runs_.size();
    const uint8_t* row = known.data() + size_t{y} * width;
    for (uint32_t x = 0; x < width;) {
      if (!row[x]) {
        ++found.unknown_px;
        ++x;
        continue;
      }
      const uint32_t first = x;
      while (x < width && row[x]) ++x;
      runs_.push_back({y, first, x - 1});
      parent_.push_back(static_cast<uint32_t>(parent_.size()));
    }
    for (size_t here = row_start, up = above; here < runs_.size() && up < row_start;) {
      if (runs_[up].last >= runs_[here].first && runs_[here].last >= runs_[up].first)
        parent_[root(static_cast<uint32_t>(here))] = root(static_cast<uint32_t>(up));
      if (runs_[up].last < runs_[here].last) {
        ++up;
      } else {
        ++here;
      }
    }
  }
  number_.assign(runs_.size(), 0);
  for (uint32_t i = 0; i < runs_.size(); ++i)
    if (parent_[i] == i) number_[i] = ++found.count;
  if (touched) {
    has_touch_.assign(runs_.size(), 0);
    for (uint32_t i = 0; i < runs_.size(); ++i) {
      uint8_t& mark = has_touch_[root(i)];
      for (uint32_t x = runs_[i].first; x <= runs_[i].last && !mark; ++x)
        mark = touched(x, runs_[i].y) ? 1 : 0;
    }
    found.touched = static_cast<uint32_t>(std::count(has_touch_.begin(), has_touch_.end(), uint8_t{1}));
  }
  if (labels) {
    labels->assign(size_t{width} * height, 0);
    for (uint32_t i = 0; i < runs_.size(); ++i) {
      const auto row = labels->begin() + static_cast<std::ptrdiff_t>(size_t{runs_[i].y} * width);
      std::fill(row + runs_[i].first, row + runs_[i].last + 1, number_[root(i)]);
    }
  }
  return found;
}

Islands find_islands(std::span<const uint8_t> known, uint32_t width, uint32_t height,
                     const std::function<bool(uint32_t x, uint32_t y)>& touched,
                     std::vector<uint32_t>* labels) {
  return IslandFinder().find(known, width, height, touched, labels);
}

}  // namespace palpate
