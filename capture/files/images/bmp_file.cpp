#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/core.hpp>

#include "capture/files/images/image_file.h"

namespace palpate {
namespace {

using Bytes = std::span<const uint8_t>;
using BmpColour = std::array<uint8_t, 3>;  ///< blue, green, red

enum Packing : uint32_t { kPlain = 0, kRuns8 = 1, kRuns4 = 2, kMasks = 3 };

uint32_t number(Bytes b, size_t at, int count) {
  if (at > b.size() || b.size() - at < static_cast<size_t>(count)) return 0;
  uint32_t value = 0;
  for (int i = 0; i < count; ++i) value |= uint32_t{b[at + static_cast<size_t>(i)]} << 8 * i;
  return value;
}

struct Bitmap {
  Bytes bytes;
  size_t pixels_at;
  int width, height;
  bool upwards;  ///< the first stored row is the lowest
  uint32_t bits, packing;
  std::array<BmpColour, 256> palette{};
  bool gray = false;

  size_t row_bytes() const { return (static_cast<size_t>(width) * bits + 31) / 32 * 4; }
  /// Whether the file is long enough for all rows, asked before memory is taken for them. Runs may leave rows
  /// out: then it is a matter of what is worth its memory.
  bool may_be_whole() const {
    const size_t left = bytes.size() - std::min(pixels_at, bytes.size()), rows = static_cast<size_t>(height);
    constexpr size_t kLarge_px = size_t{1} << 22, kEndOfRow_bytes = 2;
    if (packing == kRuns8 || packing == kRuns4)
      return rows * static_cast<size_t>(width) <= kLarge_px || left / kEndOfRow_bytes >= rows;
    return left / row_bytes() >= rows;
  }
  int row(int stored) const { return upwards ? height - 1 - stored : stored; }
};

void read_palette(Bitmap& b, size_t at, uint32_t colours) {
  b.gray = true;
  for (uint32_t i = 0; i < colours; ++i) {
    const uint32_t value = number(b.bytes, at + 4 * i, 4);
    b.palette[i] = {static_cast<uint8_t>(value), static_cast<uint8_t>(value >> 8),
                    static_cast<uint8_t>(value >> 16)};
    b.gray = b.gray && b.palette[i][0] == b.palette[i][1] && b.palette[i][1] == b.palette[i][2];
  }
}

void put(cv::Mat& image, int x, int y, const BmpColour& colour) {
  std::memcpy(image.ptr(y) + static_cast<ptrdiff_t>(x) * image.channels(), colour.data(),
              static_cast<size_t>(image.channels()));
}

/// Rows of 1, 4 or 8 bits a pixel that number a colour, or of 16, 24 and 32 that are one.
bool decode_plain(const Bitmap& b, cv::Mat& image) {
  const size_t row_bytes = b.row_bytes();
  const bool five_five_five = b.packing != kMasks || number(b.bytes, 58, 4) == 0x3e0;
  for (int stored = 0; stored < b.height; ++stored) {
    const uint8_t* from = b.bytes.data() + b.pixels_at + static_cast<size_t>(stored) * row_bytes;
    for (int x = 0; x < b.width; ++x) {
      BmpColour colour;
      if (b.bits <= 8) {
        const auto bit = static_cast<uint32_t>(x) * b.bits;
        colour = b.palette[from[bit / 8] >> (8 - b.bits - bit % 8) & ((1u << b.bits) - 1)];
      } else if (b.bits == 16) {
        const uint32_t v = from[2 * x] | uint32_t{from[2 * x + 1]} << 8;
        colour = five_five_five ? BmpColour{static_cast<uint8_t>(v << 3), static_cast<uint8_t>(v >> 2 & 0xf8),
                                            static_cast<uint8_t>(v >> 7 & 0xf8)}
                                : BmpColour{static_cast<uint8_t>(v << 3), static_cast<uint8_t>(v >> 3 & 0xfc),
                                            static_cast<uint8_t>(v >> 8 & 0xf8)};
      } else {
        const uint8_t* at = from + static_cast<ptrdiff_t>(x) * (b.bits / 8);
        colour = {at[0], at[1], at[2]};
      }
      put(image, x, b.row(stored), colour);
    }
  }
  return true;
}

/// Runs of one number, literal stretches and jumps; what a jump passes over has the first colour.
bool decode_runs(const Bitmap& b, cv::Mat& image) {
  image.setTo(cv::Scalar(b.palette[0][0], b.palette[0][1], b.palette[0][2]));
  const bool four = b.packing == kRuns4;
  size_t at = b.pixels_at;
  int x = 0, y = 0;
  const auto pixel = [&](uint8_t value, int i) {
    const uint8_t index = four ? (i % 2 ? value & 15 : value >> 4) : value;
    if (x >= b.width || y >= b.height) return false;
    put(image, x++, b.row(y), b.palette[index]);
    return true;
  };
  while (at + 1 < b.bytes.size()) {
    const uint8_t count = b.bytes[at], value = b.bytes[at + 1];
    at += 2;
    if (count > 0) {
      for (int i = 0; i < count; ++i)
        if (!pixel(value, i)) return false;
    } else if (value == 0) {
      x = 0;
      ++y;
    } else if (value == 1) {
      return true;
    } else if (value == 2) {
      if (at + 1 >= b.bytes.size()) return false;
      x += b.bytes[at];
      y += b.bytes[at + 1];
      at += 2;
    } else {
      const size_t length = four ? (value + 1u) / 2 : value;
      if (length > b.bytes.size() - at) return false;
      for (int i = 0; i < value; ++i)
        if (!pixel(b.bytes[at + static_cast<size_t>(four ? i / 2 : i)], i)) return false;
      at += (length + 1) / 2 * 2;
    }
  }
  return y >= b.height;
}

/// The colours' masks that are decoded: 5, 5, 5 and 5, 6, 5 bits, and whole bytes.
bool known_masks(const Bitmap& b) {
  const std::array found = {number(b.bytes, 54, 4), number(b.bytes, 58, 4), number(b.bytes, 62, 4)};
  if (b.bits == 32) return found == std::array{0xff0000u, 0xff00u, 0xffu};
  return b.bits == 16 &&
         (found == std::array{0x7c00u, 0x3e0u, 0x1fu} || found == std::array{0xf800u, 0x7e0u, 0x1fu});
}

}  // namespace

cv::Mat decode_bmp(Bytes bytes) {
  const auto width = static_cast<int32_t>(number(bytes, 18, 4)),
             height = static_cast<int32_t>(number(bytes, 22, 4));
  const uint32_t head_bytes = number(bytes, 14, 4), colours = number(bytes, 46, 4);
  if (width <= 0 || height == 0 || height == INT32_MIN || head_bytes < 40) return {};
  Bitmap b{bytes,
           number(bytes, 10, 4),
           width,
           std::abs(height),
           height > 0,
           number(bytes, 28, 2),
           number(bytes, 30, 4)};
  if (b.bits == 1 || b.bits == 4 || b.bits == 8) {
    if (colours > 256) return {};
    read_palette(b, 14 + head_bytes, colours != 0 ? colours : 1u << b.bits);
  } else if (b.bits != 16 && b.bits != 24 && b.bits != 32) {
    return {};
  }
  if (!b.may_be_whole()) return {};
  cv::Mat image(b.height, b.width, b.gray ? CV_8UC1 : CV_8UC3);
  bool whole = false;
  if (b.packing == kPlain || (b.packing == kMasks && known_masks(b)))
    whole = decode_plain(b, image);
  else if ((b.packing == kRuns8 && b.bits == 8) || (b.packing == kRuns4 && b.bits == 4))
    whole = decode_runs(b, image);
  return whole ? image : cv::Mat();
}

}  // namespace palpate
