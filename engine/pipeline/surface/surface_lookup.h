// Surface from a table of gray to depth: SurfaceReading::Lookup. Depth is absolute: there is no rest level to
// be found.
#pragma once

#include "engine/pipeline/surface/surface_method.h"
#include "engine/stages/surface/lookup.h"

namespace palpate {

class LookupSurface : public SurfaceMethod {
 public:
  LookupSurface(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const FramePlan& plan,
                const Contact& contact, const Tuning& tuning);

  void record(gpu::Commands& commands, FrameSlot& slot) override;
  SurfacePart measure(const FrameSlot& slot, const ContactTouch& whole) const override;
  uint64_t memory_bytes() const override { return lookup_.memory_bytes(); }
  using SurfaceMethod::memory_bytes;

 private:
  Lookup lookup_;
};

}  // namespace palpate
