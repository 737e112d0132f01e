#include "engine/pipeline/contact_tiles.h"
#include "engine/base/divide_up.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

constexpr uint32_t kTile = ContactTiles::kTile_px;
constexpr uint32_t kReach = ContactTiles::kReach_px;
constexpr uint32_t kOutput =
    kTile + 2 * kReach;  // filtered pixels that a raw pixel of the tile takes part in
constexpr uint32_t kInput = kOutput + 2 * kReach;

template <typename Pixel>
const Pixel* row_of(const Frame& frame, uint32_t channel, uint32_t y) {
  return reinterpret_cast<const Pixel*>(frame.row(channel, y));
}

template <typename Pixel, Signal kSignal>
Pixel change(Pixel image, Pixel rest) {
  const Pixel larger = std::max(image, rest);
  if constexpr (kSignal == Signal::Brighter) return static_cast<Pixel>(larger - rest);
  if constexpr (kSignal == Signal::Darker) return static_cast<Pixel>(larger - image);
  return static_cast<Pixel>(larger - std::min(image, rest));
}

// The loops that touch each pixel: plain enough for the compiler to take sixteen at a time.
template <typename Pixel, Signal kSignal>
void raise(const Pixel* image, const Pixel* rest, uint32_t width, Pixel* __restrict largest_change,
           Pixel* __restrict brightest) {
  for (uint32_t x = 0; x < width; ++x) {
    largest_change[x] = std::max(largest_change[x], change<Pixel, kSignal>(image[x], rest[x]));
    brightest[x] = std::max(brightest[x], image[x]);
  }
}

template <typename Pixel>
Pixel largest(const Pixel* values, uint32_t count) {
  Pixel result = 0;
  for (uint32_t i = 0; i < count; ++i) result = std::max(result, values[i]);
  return result;
}

// Sums of the filter's weights 1 4 6 4 1 each way: 8-bit pixels fit 16 bits, 16-bit ones 32.
template <typename Pixel>
struct Wide {
  using Sum = uint32_t;
};
template <>
struct Wide<uint8_t> {
  using Sum = uint16_t;
};

template <typename Sum>
Sum five(Sum a, Sum b, Sum c, Sum d, Sum e) {
  const auto outer = static_cast<Sum>(a + e), inner = static_cast<Sum>(b + d),
             both = static_cast<Sum>(inner + c);
  return static_cast<Sum>(static_cast<Sum>(outer + static_cast<Sum>(both << 2)) + static_cast<Sum>(c << 1));
}

template <typename Pixel, Signal kSignal>
void add_changes(const Pixel* image, const Pixel* rest, uint32_t count, Pixel* __restrict changes) {
  for (uint32_t x = 0; x < count; ++x)
    changes[x] = std::max(changes[x], change<Pixel, kSignal>(image[x], rest[x]));
}

// Value x is that of pixel x + 2.
template <typename Pixel, typename Sum>
void filter_across(const Pixel* __restrict pixels, uint32_t count, Sum* __restrict out) {
  for (size_t x = 0; x < count; ++x)
    out[x] = five<Sum>(pixels[x], pixels[x + 1], pixels[x + 2], pixels[x + 3], pixels[x + 4]);
}

template <typename Sum>
void filter_down(const Sum* a, const Sum* b, const Sum* c, const Sum* d, const Sum* e, uint32_t count,
                 Sum* __restrict most) {
  for (uint32_t x = 0; x < count; ++x) most[x] = std::max(most[x], five<Sum>(a[x], b[x], c[x], d[x], e[x]));
}

}  // namespace

ContactTiles::ContactTiles(const Sensor& sensor, const FrameFormat& format)
    : signal_(sensor.signal),
      reach_(static_cast<uint32_t>(std::lround(sensor.threshold_gray * 128)) * 2),
      saturation_(sensor.saturation_gray),
      dead_(dead_gray(sensor)),
      change_(2 * size_t{format.width}),
      bright_(2 * size_t{format.width}),
      row_(2 * (size_t{format.width} + 2 * kReach)),
      most_(4 * size_t{format.width}) {
  for (auto& row : across_) row.resize(4 * size_t{format.width});
  tiles_.columns = divide_up(format.width, kTile);
  tiles_.rows = divide_up(format.height, kTile);
  tiles_.touched.resize(size_t{tiles_.columns} * tiles_.rows);
}

const TouchedTiles& ContactTiles::find(const Frame& frame) {
  assert(frame.format == background_.format);
  const bool wide = frame.format.bit_depth > 8;
  switch (signal_) {
    case Signal::Brighter:
      wide ? find_as<uint16_t, Signal::Brighter>(frame) : find_as<uint8_t, Signal::Brighter>(frame);
      break;
    case Signal::Darker:
      wide ? find_as<uint16_t, Signal::Darker>(frame) : find_as<uint8_t, Signal::Darker>(frame);
      break;
    case Signal::Either:
      wide ? find_as<uint16_t, Signal::Either>(frame) : find_as<uint8_t, Signal::Either>(frame);
      break;
  }
  return tiles_;
}

template <typename Pixel, Signal kSignal>
void ContactTiles::find_as(const Frame& frame) {
  const FrameFormat& format = frame.format;
  auto* change_row = reinterpret_cast<Pixel*>(change_.data());
  auto* bright_row = reinterpret_cast<Pixel*>(bright_.data());
  const auto* most = reinterpret_cast<const typename Wide<Pixel>::Sum*>(most_.data());
  tiles_.count = tiles_.saturated_px = 0;
  uint32_t left = UINT32_MAX, top = UINT32_MAX, right = 0, bottom = 0;
  for (uint32_t row = 0; row < tiles_.rows; ++row) {
    const uint32_t y0 = row * kTile, y1 = std::min(y0 + kTile, format.height);
    std::fill_n(change_row, format.width, Pixel{0});
    std::fill_n(bright_row, format.width, Pixel{0});
    for (uint32_t channel = 0; channel < format.channels; ++channel)
      for (uint32_t y = y0; y < y1; ++y)
        raise<Pixel, kSignal>(row_of<Pixel>(frame, channel, y), row_of<Pixel>(background_, channel, y),
                              format.width, change_row, bright_row);
    const auto loud = [&](uint32_t column) {
      const uint32_t x0 = column * kTile, x1 = std::min(x0 + kTile, format.width);
      return uint64_t{largest(change_row + x0, x1 - x0)} * 256 >= reach_;
    };
    uint8_t* touched = tiles_.touched.data() + size_t{row} * tiles_.columns;
    std::fill_n(touched, tiles_.columns, uint8_t{0});
    for (uint32_t column = 0; column < tiles_.columns; ++column) {
      const uint32_t x0 = column * kTile, x1 = std::min(x0 + kTile, format.width);
      if (largest(bright_row + x0, x1 - x0) >= saturation_)
        tiles_.saturated_px += saturated<Pixel>(frame, {x0, y0, x1 - x0, y1 - y0});
    }
    for (uint32_t column = 0; column < tiles_.columns; ++column) {
      if (!loud(column)) continue;
      uint32_t end = column + 1;
      while (end < tiles_.columns && loud(end)) ++end;
      filter_run<Pixel, kSignal>(frame, column * kTile, std::min(end * kTile, format.width), y0);
      for (; column < end; ++column) {
        const uint32_t x0 = column * kTile, x1 = std::min(x0 + kTile, format.width);
        const uint32_t first = std::max(x0, kReach) - kReach, last = std::min(x1 + kReach, format.width);
        touched[column] = largest(most + first, last - first) >= reach_;
        if (!touched[column]) continue;
        ++tiles_.count;
        left = std::min(left, x0);
        right = std::max(right, x1);
        top = std::min(top, y0);
        bottom = y1;
      }
    }
  }
  tiles_.box = tiles_.count > 0 ? PixelRect{left, top, right - left, bottom - top} : PixelRect{};
}

// Filters the loud tiles of columns x0 to x1 and the pixels beside them, and leaves in most_ the largest
// value of each column.
template <typename Pixel, Signal kSignal>
void ContactTiles::filter_run(const Frame& frame, uint32_t x0, uint32_t x1, uint32_t y0) {
  using Sum = typename Wide<Pixel>::Sum;
  const FrameFormat& format = frame.format;
  const uint32_t left = std::max(x0, kReach) - kReach, right = std::min(x1 + kReach, format.width);
  const uint32_t top = std::max(y0, kReach) - kReach;
  const uint32_t bottom = std::min(y0 + kTile + kReach, format.height);
  const uint32_t columns = right - left;
  // Raw pixels that take part, and copies of the edge pixels beyond the frame.
  const uint32_t first = std::max(left, kReach) - kReach, last = std::min(right + kReach, format.width);
  const uint32_t before = first + kReach - left, after = right + kReach - last;
  auto* changes = reinterpret_cast<Pixel*>(row_.data());
  auto* most = reinterpret_cast<Sum*>(most_.data()) + left;
  std::fill_n(most, columns, Sum{0});

  const auto across = [&](int64_t y) {
    return reinterpret_cast<Sum*>(across_[static_cast<size_t>((y + 5) % 5)].data());
  };
  const auto take_row = [&](int64_t y) {
    const auto from = static_cast<uint32_t>(std::clamp<int64_t>(y, 0, int64_t{format.height} - 1));
    std::fill_n(changes, columns + 2 * kReach, Pixel{0});
    for (uint32_t channel = 0; channel < format.channels; ++channel)
      add_changes<Pixel, kSignal>(row_of<Pixel>(frame, channel, from) + first,
                                  row_of<Pixel>(background_, channel, from) + first, last - first,
                                  changes + before);
    std::fill_n(changes, before, changes[before]);
    std::fill_n(changes + columns + 2 * kReach - after, after, changes[columns + 2 * kReach - after - 1]);
    filter_across(changes, columns, across(y));
  };
  for (int64_t y = int64_t{top} - 2; y < int64_t{top} + 2; ++y) take_row(y);
  for (int64_t y = top; y < bottom; ++y) {
    take_row(y + 2);
    filter_down(across(y - 2), across(y - 1), across(y), across(y + 1), across(y + 2), columns, most);
  }
}

template <typename Pixel>
uint64_t ContactTiles::saturated(const Frame& frame, const PixelRect& tile) const {
  uint64_t count = 0;
  for (uint32_t y = tile.y; y < tile.y + tile.height; ++y) {
    std::array<Pixel, kTile> brightest{}, at_rest{};
    for (uint32_t channel = 0; channel < frame.format.channels; ++channel) {
      const Pixel* row = row_of<Pixel>(frame, channel, y) + tile.x;
      const Pixel* rest = row_of<Pixel>(background_, channel, y) + tile.x;
      for (uint32_t x = 0; x < tile.width; ++x) {
        brightest[x] = std::max(brightest[x], row[x]);
        at_rest[x] = std::max(at_rest[x], rest[x]);
      }
    }
    for (uint32_t x = 0; x < tile.width; ++x) count += brightest[x] >= saturation_ && at_rest[x] < dead_;
  }
  return count;
}

}  // namespace palpate
