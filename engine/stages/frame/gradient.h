// Gradient stage: slope of the change from the untouched image, summed over the frame (Touch::gradient_sum).
#pragma once

#include <cstdint>
#include <span>

#include "engine/gpu/kernel.h"
#include "engine/gpu/tuning.h"
#include "engine/stages/frame/upload.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "shaders/shared/gradient.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// A gel's colours show slopes, so that what changes from pixel to pixel is its bending, where objects press
/// on it; light that drifts, or glows through the gel, changes evenly and is left out.
class Gradient {
 public:
  /// Frames of 8 bits, gray or colour. Its form is that of the contact stage.
  Gradient(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const Tuning& tuning);

  uint64_t record_bytes() const { return uint64_t{push_.tiles_x} * push_.tiles_y * sizeof(uint32_t); }

  /// Leaves one number for each tile in `sums`. With BackgroundKind::None `background` is not read.
  void record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
              const gpu::DeviceBuffer& sums) const;
  /// Adds the tiles up: 1/128 gray level per px, summed over the frame's pixels.
  uint64_t sum(std::span<const uint32_t> sums) const;

 private:
  shared::GradientPush push_{};
  bool tiled_ = false;
  gpu::Kernel kernel_;
};

}  // namespace palpate
