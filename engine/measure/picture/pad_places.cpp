#include "engine/measure/picture/pad_places.h"

#include <algorithm>

#include "engine/sensor/outline.h"

namespace palpate {

template <typename In>
static PadRun longest_run(uint32_t count, In&& in) {
  PadRun best, now;
  for (uint32_t i = 0; i < count; ++i) {
    if (!in(i)) {
      now = {i + 1, i + 1};
      continue;
    }
    now.to = i + 1;
    if (now.length() > best.length()) best = now;
  }
  return best;
}

PadPlaces::PadPlaces(const FrameFormat& format, const std::optional<PadOutline>& pad, uint32_t part,
                     uint32_t bands, uint32_t band_rows)
    : parts(std::max(1u, format.width / part)), in(size_t{format.height} * parts, true) {
  if (!pad) {
    parts_of_row.assign(format.height, {0, parts});
    rows_of_part.assign(parts, {0, format.height});
    columns.assign(bands, {0, format.width});
    return;
  }
  const uint32_t width = std::min(part, format.width);
  std::vector<uint32_t> rows_in(format.width);  // of the band, in each column
  for (uint32_t y = 0; y < format.height; ++y) {
    for (uint32_t x = 0; x < format.width; ++x) {
      const bool inside = contains(*pad, x, y);
      rows_in[x] += inside;
      if (!inside && x / width < parts) in[size_t{y} * parts + x / width] = false;
    }
    parts_of_row.push_back(longest_run(parts, [&](uint32_t i) { return has(i, y, 1); }));
    if ((y + 1) % band_rows != 0) continue;
    if (columns.size() < bands)
      columns.push_back(longest_run(format.width, [&](uint32_t x) { return rows_in[x] == band_rows; }));
    std::fill(rows_in.begin(), rows_in.end(), 0u);
  }
  for (uint32_t i = 0; i < parts; ++i)
    rows_of_part.push_back(longest_run(format.height, [&](uint32_t y) { return has(i, y, 1); }));
}

bool PadPlaces::has(uint32_t i, uint32_t y, uint32_t rows) const {
  for (uint32_t v = y; v < y + rows; ++v)
    if (!in[size_t{v} * parts + i]) return false;
  return true;
}

}  // namespace palpate
