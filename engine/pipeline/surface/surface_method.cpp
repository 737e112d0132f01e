#include "engine/pipeline/surface/surface_method.h"

#include <algorithm>

#include "engine/pipeline/surface/weighted_solve.h"

namespace palpate {

SurfaceMethod::SurfaceMethod(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                             const Contact& contact, const Tuning& tuning)
    : context_(context),
      sensor_(sensor),
      format_(format),
      grid_(grid_for(format.width, format.height)),
      rest_level_(context, contact, grid_, tuning) {}

void SurfaceMethod::make(FrameSlot& slot) const {
  slot.surface.depth = FloatMap(context_, "depth", grid_);
  slot.surface.rest_records =
      gpu::DeviceBuffer(context_, "rest level records", rest_level_.record_bytes(), gpu::Memory::Readback);
}

void SurfaceMethod::solve(FrameSlot&) {}

void SurfaceMethod::record_rest_level(gpu::Commands& commands, FrameSlot& slot) const {
  rest_level_.record(commands, slot.surface.depth, slot.records, slot.surface.rest_records);
}

RestHeight SurfaceMethod::rest_of(const FrameSlot& slot) const {
  slot.surface.rest_records.invalidate();
  return rest_level_.find(slot.records.as<const shared::ContactRecord>(),
                          slot.surface.rest_records.as<const shared::RestLevelRecord>());
}

SurfaceSummary SurfaceMethod::measure_heights(const FrameSlot& slot) const {
  const RestHeight rest = rest_of(slot);
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
  slot.surface.solved = gpu::DeviceBuffer(context_, "solved heights", grid_.bytes(), gpu::Memory::Upload);
  std::ranges::fill(slot.surface.solved.as<float>(), 0.0f);  // the host writes none of the rows' padding
  slot.surface.after_solve = gpu::Commands(context_);
}

void SurfaceMethod::record_host_solve(gpu::Commands& commands, const gpu::DeviceBuffer& from,
                                      FrameSlot& slot) const {
  SurfaceSlot& s = slot.surface;
  commands.copy(from, s.right_side, from.bytes());
  s.after_solve.begin();
  s.after_solve.copy(s.solved, s.depth.buffer, grid_.bytes());
  s.after_solve.barrier();
  record_rest_level(s.after_solve, slot);
  s.after_solve.host_barrier();
  s.after_solve.end();
}

void SurfaceMethod::finish_host_solve(FrameSlot& slot) {
  slot.surface.solved.flush();
  slot.surface.after_solve.submit();
  slot.surface.after_solve.wait();
}

void SurfaceMethod::add_times(const FrameSlot& slot, std::vector<gpu::ScopeTime>& times) const {
  const auto more = slot.surface.after_solve.times();
  times.insert(times.end(), more.begin(), more.end());
}

uint64_t SurfaceMethod::memory_bytes(const FrameSlot& slot) const {
  const SurfaceSlot& s = slot.surface;
  return s.depth.buffer.bytes() + s.rest_records.bytes() + s.clipped.bytes() + s.border_records.bytes() +
         s.right_side.bytes() + s.solved.bytes() + WeightedSolve::memory_bytes(s.weighted);
}

}  // namespace palpate
