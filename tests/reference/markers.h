// Markers found and filled by plain loops.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "palpate/frame.h"
#include "shaders/shared/markers.h"

namespace palpate::reference {

using Cell = std::array<int, 3>;  ///< red, green, blue

template <typename T>
struct Grid {
  int width = 0, height = 0;
  std::vector<T> values{};

  Grid(int w, int h) : width(w), height(h), values(static_cast<size_t>(w) * static_cast<size_t>(h)) {}
  T& at(int x, int y) {
    return values[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  const T& at(int x, int y) const { return const_cast<Grid*>(this)->at(x, y); }
  const T& near(int x, int y) const { return at(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1)); }
};
using Cells = Grid<Cell>;
using Mask = Grid<uint8_t>;

/// Four times the mean of each cell.
inline Cells cells_of(const Frame& frame, int side) {
  const int w = static_cast<int>(frame.format.width), h = static_cast<int>(frame.format.height);
  Cells cells((w + side - 1) / side, (h + side - 1) / side);
  for (int y = 0; y < cells.height; ++y)
    for (int x = 0; x < cells.width; ++x)
      for (uint32_t c = 0; c < 3; ++c)
        for (int k = 0; k < 4; ++k) {
          const int px = std::min(side * x + k % side, w - 1), py = std::min(side * y + k / 2 % side, h - 1);
          cells.at(x, y)[c] +=
              static_cast<int>(frame.at(c, static_cast<uint32_t>(px), static_cast<uint32_t>(py)));
        }
  return cells;
}

/// Mean of a block's brighter squares of 2 x 2 px.
inline Cells block_light(const Frame& frame) {
  const Cells cells = cells_of(frame, 2);
  const int side = static_cast<int>(shared::kMarkerBlock) / 2;
  Cells light((cells.width + side - 1) / side, (cells.height + side - 1) / side);
  for (int y = 0; y < light.height; ++y)
    for (int x = 0; x < light.width; ++x)
      for (size_t c = 0; c < 3; ++c) {
        std::vector<int> values;
        for (int j = side * y; j < std::min(side * y + side, cells.height); ++j)
          for (int i = side * x; i < std::min(side * x + side, cells.width); ++i)
            values.push_back(cells.at(i, j)[c]);
        const int all = std::accumulate(values.begin(), values.end(), 0),
                  count = static_cast<int>(values.size());
        std::erase_if(values, [&](int v) { return v * count < all; });
        light.at(x, y)[c] =
            std::accumulate(values.begin(), values.end(), 0) / static_cast<int>(values.size());
      }
  return light;
}

/// The largest, or the smallest, of the blocks around.
inline Cells extreme(const Cells& light, int reach, bool largest) {
  Cells out = light;
  for (int y = 0; y < light.height; ++y)
    for (int x = 0; x < light.width; ++x)
      for (int j = -reach; j <= reach; ++j)
        for (int i = -reach; i <= reach; ++i)
          for (size_t c = 0; c < 3; ++c) {
            const int v = light.near(x + i, y + j)[c];
            int& to = out.at(x, y)[c];
            to = largest ? std::max(to, v) : std::min(to, v);
          }
  return out;
}

inline Mask dark_cells(const Cells& cells, const Cells& closed, const shared::MarkersPush& push) {
  const int side = static_cast<int>(shared::kMarkerBlock / push.cell), steps = 2 * side;
  const int64_t threshold = push.threshold, whole = steps * steps;
  Mask dark(cells.width, cells.height);
  for (int y = 0; y < cells.height; ++y)
    for (int x = 0; x < cells.width; ++x) {
      // Linear between the middles of blocks, in half cells.
      const int u = 2 * x + 1 + side, v = 2 * y + 1 + side, bx = u / steps - 1, by = v / steps - 1,
                f = u % steps, g = v % steps;
      int64_t darkness = 0, light = 0;
      bool each = true;
      for (size_t c = 0; c < 3; ++c) {
        const int level =
            (steps - g) * ((steps - f) * closed.near(bx, by)[c] + f * closed.near(bx + 1, by)[c]) +
            g * ((steps - f) * closed.near(bx, by + 1)[c] + f * closed.near(bx + 1, by + 1)[c]);
        const int64_t less = level - whole * cells.at(x, y)[c],
                      above = level + whole * static_cast<int>(shared::kMarkerBlack);
        darkness += less;
        light += above;
        each = each && less * shared::kMarkerDarkEach > threshold * above;
      }
      dark.at(x, y) = each && darkness * shared::kMarkerDark > threshold * light;
    }
  return dark;
}

inline Mask marker_cells(const Frame& frame, const Cells& cells, const shared::MarkersPush& push) {
  const int closing = static_cast<int>(push.closing), rim = static_cast<int>(shared::kMarkerRim);
  const Cells light = extreme(extreme(block_light(frame), closing, true), closing, false);
  const Mask dark = dark_cells(cells, light, push);
  Mask marked = dark;
  for (int y = 0; y < dark.height; ++y)
    for (int x = 0; x < dark.width; ++x)
      for (int j = -rim; j <= rim; ++j)
        for (int i = -rim; i <= rim; ++i) marked.at(x, y) |= dark.near(x + i, y + j);
  return marked;
}

/// What marked cells would show: the mean of the nearest known cells along row and column by their inverse
/// distance (mean value coordinates; exact where the image is linear). Returns those where no two lie on
/// opposite sides.
inline Mask fill_cells(Cells& cells, const Mask& marked, const Cells* rest, int reach) {
  constexpr int kDx[] = {1, 0}, kDy[] = {0, 1};
  const Cells known = cells;
  Mask unknown(cells.width, cells.height);
  for (int y = 0; y < cells.height; ++y)
    for (int x = 0; x < cells.width; ++x) {
      if (!marked.at(x, y)) continue;
      Cell sum{};
      int weights = 0;
      bool between = false;
      for (int d = 0; d < 2; ++d) {
        int sides = 0;
        for (const int way : {1, -1}) {
          for (int n = 1; n <= reach; ++n) {
            const int i = x + way * n * kDx[d], j = y + way * n * kDy[d];
            if (i < 0 || j < 0 || i >= cells.width || j >= cells.height) break;
            if (marked.at(i, j)) continue;
            const int w = static_cast<int>(shared::kMarkerNear) / n;
            for (size_t c = 0; c < 3; ++c) sum[c] += w * known.at(i, j)[c];
            weights += w;
            ++sides;
            break;
          }
        }
        between = between || sides == 2;
      }
      unknown.at(x, y) = !between;
      if (between)
        for (size_t c = 0; c < 3; ++c) {
          const int from = rest ? rest->at(x, y)[c] : 0;
          const int value = (sum[c] + (sum[c] < 0 ? -weights : weights) / 2) / weights;
          cells.at(x, y)[c] = std::clamp(from + value, 0, 1020) - from;
        }
    }
  return unknown;
}

/// A frame without its markers. `rest`, none or an image without its own: what is continued is the change
/// from it.
struct Filled {
  Frame frame;
  Mask marked, unknown;
};

inline Filled fill_markers(const Frame& frame, const Frame* rest, const Mask* rest_marked,
                           const shared::MarkersPush& push) {
  const int side = static_cast<int>(push.cell);
  Cells cells = cells_of(frame, side);
  Filled filled{frame, marker_cells(frame, cells, push), Mask(cells.width, cells.height)};
  const Cells untouched = cells_of(rest ? *rest : frame, side);
  if (rest) {
    for (size_t i = 0; i < cells.values.size(); ++i) {
      for (size_t c = 0; c < 3; ++c) cells.values[i][c] -= untouched.values[i][c];
      filled.marked.values[i] |= rest_marked->values[i];
    }
  }
  filled.unknown =
      fill_cells(cells, filled.marked, rest ? &untouched : nullptr, static_cast<int>(push.reach));
  const int w = static_cast<int>(frame.format.width), h = static_cast<int>(frame.format.height);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      if (!filled.marked.at(x / side, y / side)) continue;
      const auto px = static_cast<uint32_t>(x), py = static_cast<uint32_t>(y);
      const bool known = !filled.unknown.at(x / side, y / side);
      const int i = x % 2 ? 1 : -1, j = y % 2 ? 1 : -1;
      for (uint32_t c = 0; c < 3; ++c) {
        // Linear between the middles of cells, 64ths of a gray level.
        const auto at = [&](int u, int v) { return cells.near(x / side + u, y / side + v)[c]; };
        const int value = side == 1 ? 16 * at(0, 0) : 9 * at(0, 0) + 3 * (at(i, 0) + at(0, j)) + at(i, j);
        const int from = rest ? static_cast<int>(rest->at(c, px, py)) : 0;
        if (known)
          filled.frame.set(c, px, py, static_cast<uint32_t>(std::clamp(from + ((value + 32) >> 6), 0, 255)));
        else if (rest)
          filled.frame.set(c, px, py, static_cast<uint32_t>(from));
      }
    }
  return filled;
}

}  // namespace palpate::reference
