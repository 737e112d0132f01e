#include "engine/pipeline/surface/surface_method.h"

#include <algorithm>
#include <utility>

#include "engine/pipeline/surface/weighted_solve.h"

namespace palpate {

SurfaceMethod::SurfaceMethod(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             const FramePlan& plan, const Contact& contact, const Tuning& tuning)
    : context_(context),
      sensor_(sensor),
      format_(format),
      grid_(grid_for(format.width, format.height)),
      rest_level_(context, contact, grid_, tuning),
      changes_heights_(plan.gel_contacts || plan.solve == Solve::Exact),
      reads_heights_(changes_heights_ || (plan.traction && plan.surface != SurfaceKind::Elastic) ||
                     plan.motion) {}

void SurfaceMethod::make(FrameSlot& slot) const {
  SurfaceSlot& s = slot.surface;
  s.depth = FloatMap(context_, "depth", grid_);
  if (reads_heights_ && !s.depth.buffer.mapped())
    s.readback = gpu::DeviceBuffer(context_, "depth readback", grid_.bytes(), gpu::Memory::Readback);
  if (changes_heights_) std::ranges::fill(s.on_host().as<float>(), 0.0f);  // the host writes no rows' padding
  if (s.readback && changes_heights_) {
    s.to_device = gpu::Commands(context_);
    s.to_device.begin();
    s.to_device.copy(s.readback, s.depth.buffer, grid_.bytes());
    s.to_device.host_barrier();
    s.to_device.end();
  }
  s.rest_records =
      gpu::DeviceBuffer(context_, "rest level records", rest_level_.record_bytes(), gpu::Memory::Readback);
}

void SurfaceMethod::solve(FrameSlot&) {}

void SurfaceMethod::record_rest_level(gpu::Commands& commands, FrameSlot& slot) const {
  const SurfaceSlot& s = slot.surface;
  rest_level_.record(commands, s.depth, slot.records, s.rest_records);
  if (s.readback) commands.copy(s.depth.buffer, s.readback, grid_.bytes());
}

HeightRows SurfaceMethod::heights(const FrameSlot& slot) const {
  const gpu::DeviceBuffer& heights = slot.surface.on_host();
  if (!slot.surface.changed) heights.invalidate();
  return {heights.as<float>(), grid_.width, grid_.height, grid_.pitch * 4};
}

void SurfaceMethod::finish_heights(FrameSlot& slot) const {
  SurfaceSlot& s = slot.surface;
  if (!std::exchange(s.changed, false)) return;
  const gpu::DeviceBuffer& heights = s.on_host();
  slot.records.invalidate();
  rest_level_.measure({heights.as<float>(), grid_.width, grid_.height, grid_.pitch * 4},
                      slot.records.as<const shared::ContactRecord>(),
                      s.rest_records.as<shared::RestLevelRecord>());
  s.rest_records.flush();
  heights.flush();
  if (s.readback) s.to_device.submit();
}

RestHeight SurfaceMethod::rest_of(const FrameSlot& slot) const {
  slot.surface.rest_records.invalidate();
  return rest_level_.find(slot.records.as<const shared::ContactRecord>(),
                          slot.surface.rest_records.as<const shared::RestLevelRecord>());
}

SurfaceSummary SurfaceMethod::measure_heights(const FrameSlot& slot) const {
  RestHeight rest = rest_of(slot);
  // Corrected heights are 0 where the pad is at rest, also where no whole tile is.
  if (slot.surface.was_corrected && !rest.from_untouched) {
    rest.level_mm = 0;
    rest.from_untouched = true;
  }
  SurfaceSummary summary;
  summary.depth_offset_mm = -rest.level_mm;
  summary.depth_max_mm = rest.highest_mm - rest.level_mm;
  summary.rest_from_untouched = rest.from_untouched;
  summary.volume_mm3 = volume_mm3(slot, rest.level_mm);
  return summary;
}

SurfaceSummary SurfaceMethod::measure_depths(const FrameSlot& slot) const {
  const RestHeight rest = rest_of(slot);
  SurfaceSummary summary;
  summary.depth_max_mm = rest.highest_mm;
  summary.rest_from_untouched = true;
  summary.volume_mm3 = volume_mm3(slot, rest.level_mm);
  return summary;
}

double SurfaceMethod::volume_mm3(const FrameSlot& slot, double level_mm) const {
  return rest_level_.volume_px_mm(slot.records.as<const shared::ContactRecord>(),
                                  slot.surface.rest_records.as<const shared::RestLevelRecord>(), level_mm) *
         sensor_.pitch_mm_per_px * sensor_.pitch_mm_per_px;
}

void SurfaceMethod::make_host_solve(FrameSlot& slot, const gpu::DeviceBuffer& from) const {
  slot.surface.right_side =
      gpu::DeviceBuffer(context_, "right side readback", from.bytes(), gpu::Memory::Readback);
}

uint64_t SurfaceMethod::memory_bytes(const FrameSlot& slot) const {
  const SurfaceSlot& s = slot.surface;
  return s.depth.buffer.bytes() + s.rest_records.bytes() + s.clipped.bytes() + s.border_records.bytes() +
         s.right_side.bytes() + s.readback.bytes() + WeightedSolve::memory_bytes(s.weighted);
}

}  // namespace palpate
