// A frame on the GPU, laid out so that kernels need no border code: rows padded with copies of their edge
// pixels.
#pragma once

#include <cstdint>
#include <string>

#include "engine/gpu/buffer.h"
#include "palpate/frame.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// channels x height rows of `pitch` texels of 16 bytes (16 pixels of 8 bits or 8 of 16): one texel of copies
/// of the row's first pixel, the row, and copies of its last pixel up to a whole tile of two texels and one
/// more.
struct PaddedLayout {
  explicit PaddedLayout(const FrameFormat& format);

  uint32_t pixels_per_texel;
  uint32_t tiles;  ///< of two texels, that hold a row's pixels
  uint32_t pitch;  ///< texels from one row to the next
  uint64_t bytes;  ///< of all planes
};

class PaddedImage {
 public:
  PaddedImage(gpu::Context& context, const std::string& name, const FrameFormat& format);

  /// Host side: pads the frame into mapped memory. The device must not be reading the previous one.
  void write(const Frame& frame);
  /// Whether device memory is not mapped, so that what was written has to be moved there.
  bool staged() const { return static_cast<bool>(staging_); }
  /// Device side: moves the padded frame to device memory, where that is not mapped. Needs a barrier before
  /// use.
  void record(gpu::Commands& commands) const;

  const gpu::TexelView& texels() const { return texels_; }  ///< RGBA32UI
  const gpu::TexelView& pairs() const { return pairs_; }    ///< RG32UI, two to a texel
  const gpu::TexelView& words() const { return words_; }    ///< R32UI, four to a texel
  const gpu::DeviceBuffer& buffer() const { return device_; }
  uint64_t memory_bytes() const { return device_.bytes() + staging_.bytes(); }

 private:
  FrameFormat format_;
  PaddedLayout layout_;
  gpu::DeviceBuffer device_;
  gpu::DeviceBuffer staging_;  ///< only where device memory is not mapped
  gpu::TexelView texels_;
  gpu::TexelView pairs_;
  gpu::TexelView words_;
};

}  // namespace palpate
