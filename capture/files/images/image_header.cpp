#include "capture/files/images/image_header.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace palpate {
namespace {

using Bytes = std::span<const uint8_t>;

/// Unsigned number of `count` bytes at `at`; 0 past the end.
uint64_t number(Bytes b, size_t at, int count, bool big_endian) {
  if (at > b.size() || b.size() - at < static_cast<size_t>(count)) return 0;
  uint64_t value = 0;
  for (int i = 0; i < count; ++i) value |= uint64_t{b[at + i]} << 8 * (big_endian ? count - 1 - i : i);
  return value;
}

bool starts(Bytes b, std::string_view magic) {
  return b.size() >= magic.size() && std::equal(magic.begin(), magic.end(), b.begin(), [](char c, uint8_t v) {
           return static_cast<uint8_t>(c) == v;
         });
}

/// Chunk by chunk to IEND, each with its check sum.
std::optional<ImageHeader> png(Bytes b) {
  if (b.size() < 33) return std::nullopt;
  ImageHeader h{"PNG", number(b, 16, 4, true), number(b, 20, 4, true), false};
  for (size_t at = 8; at + 12 <= b.size();) {
    const uint64_t length = number(b, at, 4, true);
    if (length > b.size() - at - 12) return h;
    if (crc32_z(0, &b[at + 4], length + 4) != number(b, at + 8 + length, 4, true)) return h;
    if (starts(b.subspan(at + 4), "IEND")) h.whole = true;
    at += length + 12;
  }
  return h;
}

std::optional<ImageHeader> jpeg(Bytes b) {
  for (size_t at = 2; at + 9 < b.size();) {
    if (b[at] != 0xff) return std::nullopt;
    const uint8_t marker = b[at + 1];
    if (marker == 0xff) {  // fill
      ++at;
      continue;
    }
    if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc) {
      // The end marker may be followed by a camera's padding.
      bool whole = false;
      for (size_t i = b.size() - 1; i > at && !whole; --i) whole = b[i] == 0xd9 && b[i - 1] == 0xff;
      return ImageHeader{"JPEG", number(b, at + 7, 2, true), number(b, at + 5, 2, true), whole};
    }
    at += 2 + number(b, at + 2, 2, true);
  }
  return std::nullopt;
}

std::optional<ImageHeader> tiff(Bytes b) {
  const bool big = b[0] == 'M';
  ImageHeader h{"TIFF", 0, 0, true};
  const uint64_t directory = number(b, 4, 4, big), entries = number(b, directory, 2, big);
  for (uint64_t i = 0; i < entries; ++i) {
    const uint64_t at = directory + 2 + 12 * i;
    const uint64_t tag = number(b, at, 2, big), kind = number(b, at + 2, 2, big);
    const uint64_t value = number(b, at + 8, kind == 3 ? 2 : 4, big);
    if (tag == 256) h.width = value;
    if (tag == 257) h.height = value;
  }
  if (h.width == 0 || h.height == 0) return std::nullopt;
  return h;
}

std::optional<ImageHeader> bmp(Bytes b) {
  if (b.size() < 34 || number(b, 30, 4, false) > 3)
    return std::nullopt;  // 3: the last kind of packing that is decoded
  const auto width = static_cast<int32_t>(number(b, 18, 4, false)),
             height = static_cast<int32_t>(number(b, 22, 4, false));
  ImageHeader h{"BMP", static_cast<uint64_t>(std::abs(int64_t{width})),
                static_cast<uint64_t>(std::abs(int64_t{height})), true};
  if (number(b, 30, 4, false) == 0)  // not compressed
    h.whole =
        b.size() >= number(b, 10, 4, false) + (h.width * number(b, 28, 2, false) + 31) / 32 * 4 * h.height;
  return h;
}

std::optional<ImageHeader> pnm(Bytes b) {
  std::array<uint64_t, 3> numbers{};  // width, height, largest value
  const int kind = b[1] - '0', count = kind == 1 || kind == 4 ? 2 : 3;
  size_t at = 2;
  for (int i = 0; i < count; ++i) {
    while (at < b.size() && (std::isspace(b[at]) || b[at] == '#')) {
      if (b[at] == '#') {
        while (at < b.size() && b[at] != '\n') ++at;
      } else {
        ++at;
      }
    }
    if (at >= b.size() || !std::isdigit(b[at])) return std::nullopt;
    for (; at < b.size() && std::isdigit(b[at]); ++at) {
      numbers[i] = numbers[i] * 10 + (b[at] - '0');
      if (numbers[i] > 1'000'000'000) return std::nullopt;
    }
  }
  ImageHeader h{"PNM", numbers[0], numbers[1], true};
  if (kind == 5 || kind == 6)
    h.whole = b.size() >= at + 1 + h.width * h.height * (kind == 6 ? 3 : 1) * (numbers[2] > 255 ? 2 : 1);
  return h;
}

}  // namespace

std::optional<ImageHeader> read_image_header(Bytes b) {
  if (starts(b, "\x89PNG\r\n\x1a\n")) return png(b);
  if (starts(b, "\xff\xd8")) return jpeg(b);
  if (starts(b, std::string_view("II*\0", 4)) || starts(b, std::string_view("MM\0*", 4))) return tiff(b);
  if (starts(b, "BM")) return bmp(b);
  if (b.size() > 2 && b[0] == 'P' && b[1] >= '1' && b[1] <= '6') return pnm(b);
  return std::nullopt;
}

}  // namespace palpate
