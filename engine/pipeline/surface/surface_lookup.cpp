#include "engine/pipeline/surface/surface_lookup.h"

namespace palpate {

LookupSurface::LookupSurface(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             const Contact& contact, const Tuning& tuning)
    : SurfaceMethod(context, sensor, format, contact, tuning),
      lookup_(context, sensor, format, contact, tuning) {}

void LookupSurface::record(gpu::Commands& commands, FrameSlot& slot) {
  lookup_.record(commands, slot.surface.depth);
  record_rest_level(commands, slot);
}

// The indented volume, all the same, counts from the rest level that the map shows.
void LookupSurface::measure(const FrameSlot& slot, Touch& touch) const {
  count_from_zero(measure_heights(slot, touch), touch);
  touch.surface->depth_sd_mm = sensor_.lookup.depth_sd_mm;
  if (touch.surface->validity == Validity::Valid && touch.peak_gray > sensor_.lookup.points.back()[0])
    touch.surface->validity = Validity::AboveRange;
}

}  // namespace palpate
