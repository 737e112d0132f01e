#include "engine/pipeline/surface/surface_elastic.h"

#include <cmath>

namespace palpate {

ElasticSurface::ElasticSurface(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                               const FramePlan& plan, const Contact& contact, const Tuning& tuning)
    : SurfaceMethod(context, sensor, format, plan, contact, tuning),
      elastic_(context, sensor, format, contact, tuning) {
  if (plan.solve == Solve::Exact)
    convolution_.emplace(LayerKernel(pad_of(sensor.elastic), sensor.pitch_mm_per_px), format.width,
                         format.height, false);
}

void ElasticSurface::make(FrameSlot& slot) const {
  SurfaceMethod::make(slot);
  slot.surface.border_records =
      gpu::DeviceBuffer(context_, "border records", Elastic::kBorderBytes, gpu::Memory::Readback);
  if (convolution_) make_host_solve(slot, elastic_.pressure());
}

void ElasticSurface::record(gpu::Commands& commands, FrameSlot& slot) {
  elastic_.record_pressure(commands, slot.surface.border_records);
  if (convolution_)
    return commands.copy(elastic_.pressure(), slot.surface.right_side, elastic_.pressure().bytes());
  elastic_.record_deflection(commands, slot.surface.depth);
  record_rest_level(commands, slot);
}

void ElasticSurface::solve(FrameSlot& slot) {
  if (!convolution_) return;
  slot.surface.right_side.invalidate();
  convolution_->depth_by_pressure(slot.surface.right_side.as<float>().data() + elastic_.pressure_start(),
                                  elastic_.pressure_pitch(), heights(slot).values.data(), grid_.pitch * 4);
  slot.surface.changed = true;
}

SurfacePart ElasticSurface::measure(const FrameSlot& slot, const ContactTouch& whole) const {
  SurfacePart part{.summary = measure_depths(slot), .faults = {}};
  part.summary.volume_mm3 = volume_mm3(slot, 0);
  part.summary.depth_sd_mm = sensor_.elastic.relative_sd * std::abs(part.summary.depth_max_mm);
  if (whole.area_px == 0) return part;
  slot.surface.border_records.invalidate();
  part.faults.at_border = Elastic::touches_border(slot.surface.border_records.as<const float>());
  part.faults.saturated =
      whole.saturated_px > 0 || whole.peak_gray > Elastic::largest_readable_gray(sensor_.elastic);
  return part;
}

}  // namespace palpate
