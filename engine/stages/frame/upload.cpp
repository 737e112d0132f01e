#include "engine/stages/frame/upload.h"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"

namespace palpate {
namespace {

constexpr uint32_t kTexelBytes = 16;

// Nothing is read from `to`: what a card maps for writing is read a hundred times slower.
template <typename Pixel>
void pad_row(const uint8_t* from, uint32_t width, uint8_t* to, uint32_t row_bytes) {
  auto* out = reinterpret_cast<Pixel*>(to);
  constexpr uint32_t kApron = kTexelBytes / sizeof(Pixel);
  Pixel first, last;
  std::memcpy(&first, from, sizeof first);
  std::memcpy(&last, from + (width - 1) * sizeof last, sizeof last);
  std::fill_n(out, kApron, first);
  std::memcpy(out + kApron, from, width * sizeof(Pixel));
  std::fill(out + kApron + width, out + row_bytes / sizeof(Pixel), last);
}

}  // namespace

PaddedLayout::PaddedLayout(const FrameFormat& format)
    : pixels_per_texel(format.bit_depth > 8 ? 8 : 16),
      tiles((format.width + 2 * pixels_per_texel - 1) / (2 * pixels_per_texel)),
      pitch(2 * tiles + 2),
      bytes(uint64_t{pitch} * kTexelBytes * format.height * format.channels) {}

PaddedImage::PaddedImage(gpu::Context& context, const std::string& name, const FrameFormat& format)
    : format_(format), layout_(format), device_(context, name, layout_.bytes, gpu::Memory::Device) {
  if (!device_.mapped())
    staging_ = gpu::DeviceBuffer(context, name + " upload", layout_.bytes, gpu::Memory::Upload);
  texels_ = gpu::TexelView(context, device_, VK_FORMAT_R32G32B32A32_UINT);
  pairs_ = gpu::TexelView(context, device_, VK_FORMAT_R32G32_UINT);
  words_ = gpu::TexelView(context, device_, VK_FORMAT_R32_UINT);
}

void PaddedImage::write(const Frame& frame) {
  assert(frame.format == format_);
  const gpu::DeviceBuffer& target = staging_ ? staging_ : device_;
  uint8_t* to = target.as<uint8_t>().data();
  const uint32_t row_bytes = layout_.pitch * kTexelBytes;
  for (uint32_t channel = 0; channel < format_.channels; ++channel) {
    for (uint32_t y = 0; y < format_.height; ++y, to += row_bytes) {
      if (format_.bit_depth > 8) {
        pad_row<uint16_t>(frame.row(channel, y), format_.width, to, row_bytes);
      } else {
        pad_row<uint8_t>(frame.row(channel, y), format_.width, to, row_bytes);
      }
    }
  }
  target.flush();
}

void PaddedImage::record(gpu::Commands& commands) const {
  if (staging_) commands.copy(staging_, device_, layout_.bytes);
}

}  // namespace palpate
