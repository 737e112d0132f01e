// Lookup stage: the filtered change of a gray gel to depth, pixel by pixel, by the sensor's table
// (SurfaceReading::Lookup). Depths are absolute: 0 is the untouched pad, no rest level is looked for.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/gpu/tuning.h"
#include "engine/stages/surface/surface.h"
#include "palpate/sensor.h"
#include "shaders/shared/lookup.h"

namespace palpate {
class Contact;
namespace gpu {
class Commands;
}

class Lookup {
 public:
  /// `contact` must keep its filtered image.
  Lookup(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const Contact& contact,
         const Tuning& tuning);

  /// Fills `depth`, mm, positive into the pad, from the contact stage's filtered image.
  void record(gpu::Commands& commands, const FloatMap& depth) const;

  uint64_t memory_bytes() const { return table_.bytes(); }

 private:
  shared::LookupPush push_{};
  uint32_t workgroup_ = 0;
  gpu::DeviceBuffer table_;
  gpu::TexelView table_words_;
  gpu::TexelView filtered_;
  gpu::Kernel kernel_;
};

}  // namespace palpate
