#include "engine/pipeline/surface/surface_lookup.h"

namespace palpate {

LookupSurface::LookupSurface(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             const FramePlan& plan, const Contact& contact, const Tuning& tuning)
    : SurfaceMethod(context, sensor, format, plan, contact, tuning),
      lookup_(context, sensor, format, contact, tuning) {}

void LookupSurface::record(gpu::Commands& commands, FrameSlot& slot) {
  lookup_.record(commands, slot.surface.depth);
  record_rest_level(commands, slot);
}

SurfacePart LookupSurface::measure(const FrameSlot& slot, const ContactTouch& whole) const {
  SurfacePart part{.summary = measure_depths(slot), .faults = {}};
  part.summary.depth_sd_mm = sensor_.lookup.depth_sd_mm;
  if (whole.area_px == 0) return part;
  part.faults.saturated = whole.saturated_px > 0;
  part.faults.above_range = whole.peak_gray > sensor_.lookup.points.back()[0];
  return part;
}

}  // namespace palpate
