// One image of the pad, as a camera, a file or the synthetic sensor delivers it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

namespace palpate {

class MappedPages;

/// Largest side of a frame, px. Sums of the contact stage are proven exact up to this size.
inline constexpr uint32_t kMaxSide_px = 16384;
/// Most pixels of a frame.
inline constexpr uint64_t kMaxPixels = uint64_t{1} << 26;

/// A rectangle of whole pixels of a frame; empty where width is 0.
struct PixelRect {
  uint32_t x = 0;
  uint32_t y = 0;
  uint32_t width = 0;
  uint32_t height = 0;

  bool operator==(const PixelRect&) const = default;
};

/// Shape of every frame of a source; it does not change while the source lives.
struct FrameFormat {
  uint32_t width = 0;      ///< px, 1 to kMaxSide_px
  uint32_t height = 0;     ///< px, 1 to kMaxSide_px
  uint32_t channels = 1;   ///< 1 (gray) or 3 (planes in the order red, green, blue)
  uint32_t bit_depth = 8;  ///< 8 to 16; above 8 a pixel takes two bytes, little endian, value in the low bits

  bool operator==(const FrameFormat&) const = default;

  size_t bytes_per_pixel() const { return bit_depth > 8 ? 2 : 1; }
  size_t row_bytes() const { return width * bytes_per_pixel(); }
  size_t plane_bytes() const { return row_bytes() * height; }
  size_t frame_bytes() const { return plane_bytes() * channels; }
  uint32_t max_gray() const { return (1u << bit_depth) - 1; }
};

/// Pixels in planes (channels x height x width), rows tightly packed, origin top left, x right, y down.
/// Reuse one Frame for many images: `reshape` allocates only when the format grows.
struct Frame {
  FrameFormat format;
  uint64_t sequence = 0;     ///< counts from 0 at the start of the source; a gap is a lost frame
  int64_t time_ns = 0;       ///< time of exposure on the source's own monotonic clock, 0 at its start
  int64_t exposed_ns = 0;    ///< the same instant on the host's CLOCK_MONOTONIC; 0: not known (recordings)
  int64_t delivered_ns = 0;  ///< when the source had the whole frame, host's CLOCK_MONOTONIC; 0: not known
  /// The frames before this one are not its predecessors: the camera was away, or someone jumped here. What
  /// is followed from frame to frame starts anew.
  bool after_gap = false;
  std::vector<uint8_t> bytes;  ///< the pixels, unless they are leased
  /// Pixels in another's memory, such as a camera driver's buffer, which goes back when the last copy of this
  /// pointer is gone; from any thread.
  std::shared_ptr<const uint8_t> leased;
  /// The mapped pages (engine/base/mapped_pages.h) that hold the leased pixels, where a device may read them
  /// in place: nothing writes there until the lease is back. Without it the pixels are copied.
  std::shared_ptr<MappedPages> pages;

  /// Gives leased pixels back; own ones stay.
  void give_back() {
    leased.reset();
    pages.reset();
  }
  void reshape(const FrameFormat& f) {
    give_back();
    format = f;
    bytes.resize(f.frame_bytes());
  }
  /// format.frame_bytes() of them.
  const uint8_t* pixels() const { return leased ? leased.get() : bytes.data(); }
  const uint8_t* row(uint32_t channel, uint32_t y) const {
    return pixels() + channel * format.plane_bytes() + y * format.row_bytes();
  }
  /// Own pixels only.
  uint8_t* row(uint32_t channel, uint32_t y) {
    return bytes.data() + channel * format.plane_bytes() + y * format.row_bytes();
  }
  /// Value of one pixel, 0 to format.max_gray().
  uint32_t at(uint32_t channel, uint32_t x, uint32_t y) const {
    const uint8_t* p = row(channel, y) + x * format.bytes_per_pixel();
    if (format.bit_depth <= 8) return *p;
    uint16_t value = 0;
    std::memcpy(&value, p, sizeof value);
    return value;
  }
  void set(uint32_t channel, uint32_t x, uint32_t y, uint32_t value) {
    uint8_t* p = row(channel, y) + x * format.bytes_per_pixel();
    if (format.bit_depth <= 8) {
      *p = static_cast<uint8_t>(value);
    } else {
      const auto wide = static_cast<uint16_t>(value);
      std::memcpy(p, &wide, sizeof wide);
    }
  }
};

}  // namespace palpate
