// Confidence stage: the confidence of each pixel's slope, 0 to 1, and the reasons for less. It is 0 where the
// camera is at its limit, where it is too dark to carry one, and beyond the pad.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/stages/frame/upload.h"
#include "engine/stages/surface/surface.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "shaders/shared/confidence.h"

namespace palpate {
namespace gpu {
class Commands;
}
class Markers;

/// Pixels of one frame, by what is wrong with them.
struct ConfidenceCounts {
  uint64_t unknown = 0;  ///< of confidence 0
  uint64_t partial = 0;  ///< between 0 and 1
  uint64_t saturated = 0;
  uint64_t shadowed = 0;
  uint64_t outside = 0;

  bool operator==(const ConfidenceCounts&) const = default;
};

/// One frame's map on the GPU and in host memory: 16 bits a pixel as in shaders/shared/confidence.h.
struct ConfidenceMap {
  ConfidenceMap() = default;
  ConfidenceMap(gpu::Context& context, uint64_t bytes);

  gpu::DeviceBuffer buffer;
  gpu::TexelView pairs;  ///< RG32UI, four pixels
};

/// Saturated: a raw value at or above Sensor::saturation_gray, in any channel, of the frame or the
/// background; behind the 5 x 5 filter (readings 'shading' and 'elastic') also the pixels within two of one.
/// Shadowed: the brightest channel of the frame or the background, v, at or below s = shadow_gray(sensor) has
/// confidence 0, from there it grows to 1 at 2 s. Outside: beyond Sensor::pad. Covered: by printed markers,
/// with nothing seen around them.
class Confidence {
 public:
  /// `markers`, if any, fills the frames and outlives this: what it could not fill has confidence 0.
  Confidence(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
             const Markers* markers = nullptr);

  /// Sets the confidence by background and outline, common to all frames; the device must not be reading the
  /// last one.
  void set_background(const Frame& background);

  uint32_t pitch() const { return push_.groups * 16; }  ///< pixels from one row of a map to the next
  uint64_t map_bytes() const { return uint64_t{push_.groups} * 32 * push_.height; }
  uint64_t record_bytes() const;
  void record(gpu::Commands& commands, const PaddedImage& frame, const ConfidenceMap& map,
              const gpu::DeviceBuffer& records) const;
  /// A map, by its pairs, as the weighted surface takes it.
  void record_weights(gpu::Commands& commands, const gpu::TexelView& map, const FloatMap& weights) const;

  /// Confidence by background and outline: a map's pairs.
  const gpu::TexelView& still_pairs() const { return still_pairs_; }
  /// The same for each pixel, height x width: not 0 where it is known.
  std::vector<uint8_t> still_known() const;
  uint64_t still_unknown_px() const { return still_unknown_px_; }
  /// Whether a frame of these counts has only the unknown pixels that every frame has, and all others have
  /// confidence 1.
  bool only_still(const ConfidenceCounts& counts) const;
  /// The opposite of what only_still() will say of a frame, found on the host from its pixels as they are
  /// uploaded; unset with markers, which only the device fills.
  std::optional<bool> lowered_by(const Frame& frame) const;

  ConfidenceCounts sum(std::span<const shared::ConfidenceRecord> records) const;
  /// height x width pixels of a finished map, in its 16 bits.
  std::vector<uint16_t> unpack(const ConfidenceMap& map) const;

  uint64_t memory_bytes() const { return still_.bytes(); }

 private:
  uint32_t invocations() const;
  template <typename Pixel>
  void find_limits();

  Sensor sensor_;
  FrameFormat format_;
  const Markers* markers_;
  shared::ConfidencePush push_{};
  uint32_t rows_ = 0;
  uint32_t reach_ = 0;
  gpu::DeviceBuffer still_;  ///< confidence of background and outline, as a map
  gpu::TexelView still_texels_, still_pairs_;
  uint64_t still_unknown_px_ = 0, still_partial_px_ = 0;
  /// Darkest and brightest value of each pixel that lowers no confidence, height x width: what is unknown in
  /// every frame may be as dark as it likes, and as bright where nothing known is near.
  std::vector<uint8_t> darkest_, brightest_;
  gpu::Kernel kernel_, weights_kernel_;
};

}  // namespace palpate
