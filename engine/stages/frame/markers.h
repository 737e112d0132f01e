// Markers stage: a gel's frame without the dots that are printed on it. What they hide is continued from
// beside them.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/stages/frame/upload.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "shaders/shared/markers.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// Pixels of one frame, to whole cells.
struct MarkerCounts {
  uint64_t marked = 0;   ///< on a marker or its rim, in the frame or in the untouched image
  uint64_t unknown = 0;  ///< of these, with nothing seen on two opposite sides to continue from
};

/// How much darker than what surrounds them the dots of an untouched image are, 0 to 1: the median over the
/// points that the skin's pattern is followed by; 0 where it shows fewer than three, or no dark ones.
double marker_darkness(const Frame& untouched, const SkinPattern& pattern);

/// Frames of three colours and 8 bits, sensors with `skin` of kind markers. A pixel belongs to a marker where
/// it is darker than the light around it by 0.4 of marker_darkness, and in each colour by a quarter of that;
/// a slope darkens some colours and lightens others. Dots up to twice SkinPattern::size_px are closed.
/// Markers move with the skin: those of the frame and of the untouched image are left out alike, with a rim
/// of 2 to 4 px, of dots below 6 px of 1 px. There the change of colour is that of the nearest pixels seen
/// along row and column, by their inverse distance (mean value coordinates; Floater, 2003), and the frame is
/// the untouched image, filled by itself, and that change.
class Markers {
 public:
  /// A frame without its markers, and what was counted in it.
  struct Slot {
    Slot(gpu::Context& context, const FrameFormat& format, uint64_t record_bytes);

    PaddedImage frame;
    gpu::DeviceBuffer records;
  };

  Markers(gpu::Context& context, const Sensor& sensor, const FrameFormat& format);

  /// Takes `background`, on the device already, as the untouched image: fills its markers there and returns
  /// it so. Commands recorded before are no longer valid.
  Frame set_background(const Frame& untouched, const PaddedImage& background);

  uint64_t record_bytes() const { return uint64_t{push_.words} * push_.cells_y * sizeof(uint32_t); }
  /// `background` as set_background left it. unknown_words() is this frame's until the next is recorded.
  void record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
              const Slot& slot) const;
  MarkerCounts sum(std::span<const uint32_t> records) const;

  /// Cells, of 2 x 2 px or (small dots) of one, that nothing is known of: a bit each in rows of 32-bit words.
  const gpu::TexelView& unknown_words() const { return unknown_words_; }
  const shared::MarkersPush& push() const { return push_; }
  uint64_t memory_bytes() const;

 private:
  struct Map {
    gpu::DeviceBuffer buffer;
    gpu::TexelView texels;
  };
  // Kernels for the untouched image, and for frames by their change from it.
  struct Kernels {
    gpu::Kernel mask, fill, frame;
  };

  void record_marked(gpu::Commands& commands, const PaddedImage& image, const Map& cells,
                     const Kernels& kernels, const gpu::DeviceBuffer& marked) const;
  void record_cells(gpu::Commands& commands, const PaddedImage& image, const Map& cells) const;

  gpu::Context& context_;
  FrameFormat format_;
  SkinPattern pattern_;
  shared::MarkersPush push_{};
  gpu::Kernel cells_kernel_, largest_, smallest_, dark_kernel_;
  Kernels untouched_, change_;
  Map cells_, rest_cells_, light_, closed_, dark_, marked_, rest_marked_;
  gpu::DeviceBuffer unknown_;
  gpu::TexelView unknown_words_;
};

}  // namespace palpate
