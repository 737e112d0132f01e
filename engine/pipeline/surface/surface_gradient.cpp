#include "engine/pipeline/surface/surface_gradient.h"

#include <cmath>
#include <numbers>

namespace palpate {
namespace {

// Whether so much of the contact is clipped that its depth cannot be right: a fraction of its area, and in
// SurfaceReading::Shading more than what the 5 x 5 filter leaves dark along its rim, whatever its slope.
bool too_many_clipped(const ContactTouch& whole, uint64_t clipped_px, const Sensor& sensor) {
  constexpr double kFraction = 0.01, kRim_px = 4;
  double allowed_px = kFraction * static_cast<double>(whole.area_px);
  if (sensor.reading == SurfaceReading::Shading) {
    // The circumference of an ellipse lies below that of the circle with the same root mean square of axes.
    const double across_px = std::hypot(whole.ellipse.major_px, whole.ellipse.minor_px);
    allowed_px += kRim_px * std::numbers::pi * across_px / std::numbers::sqrt2;
  }
  return static_cast<double>(clipped_px) > allowed_px;
}

// Whether pixels that touch has saturated are so many, compared with the contact's, that its depth cannot be
// right.
bool too_many_saturated(const ContactTouch& whole) {
  constexpr uint64_t kOneIn = 100;
  return whole.saturated_px * kOneIn > whole.area_px;
}

}  // namespace

GradientSurface::GradientSurface(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                                 const FramePlan& plan, const Contact& contact, const Confidence* confidence,
                                 const Tuning& tuning)
    : SurfaceMethod(context, sensor, format, plan, contact, tuning),
      surface_(context, format.width, format.height, plan.solve, tuning),
      slope_(context, sensor, format, contact, surface_.right_sides(), tuning),
      confidence_(confidence) {
  if (plan.solve == Solve::Exact) dct_.emplace(format.width, format.height);
  if (!plan.weights) return;
  if (surface_.right_sides() == RightSides::Cells)
    slope_.prepare_known(context);
  else
    slope_.prepare_slopes(context);
  weighted_.emplace(context, sensor, format, plan, *confidence, contact, surface_, slope_);
}

void GradientSurface::set_confidence(const Confidence& confidence) {
  // The host solves each frame by itself, with weights or without.
  if (!weighted_ || dct_) return;
  std::vector<uint8_t> known = confidence.still_known();
  if (known == known_) return;
  known_ = std::move(known);
  surface_.set_known(context_, known_);
  weighted_->set_known(known_);
}

void GradientSurface::make(FrameSlot& slot) const {
  SurfaceMethod::make(slot);
  slot.surface.clipped =
      gpu::DeviceBuffer(context_, "clipped pixels", slope_.clipped_bytes(), gpu::Memory::Readback);
  if (dct_) make_host_solve(slot, surface_.right_side().buffer);
  if (weighted_) weighted_->make(slot.surface.weighted);
}

void GradientSurface::record(gpu::Commands& commands, FrameSlot& slot) {
  if (may_weigh()) {
    // For a frame that turns out to need weights after all, or none.
    for (const bool weighted : {true, false}) {
      gpu::Commands& own = weighted ? slot.surface.weighted.commands : slot.surface.weighted.plain;
      own.begin();
      weighted_->record_filtered(own, slot);
      weighted ? record_weighted(own, slot) : record_plain(own, slot);
      own.host_barrier();
      own.end();
    }
  }
  record_plain(commands, slot);
  if (weighted_ && dct_) weighted_->record_solve(commands, slot);
}

void GradientSurface::record_plain(gpu::Commands& commands, FrameSlot& slot) const {
  if (surface_.solves_known_part())
    weighted_->record_right_side(commands, slot);
  else
    slope_.record(commands, slot.without_markers(), slot.background, surface_, slot.surface.clipped);
  if (dct_)
    return commands.copy(surface_.right_side().buffer, slot.surface.right_side,
                         surface_.right_side().buffer.bytes());
  surface_.record(commands, slot.surface.depth);
  record_rest_level(commands, slot);
}

void GradientSurface::record_weighted(gpu::Commands& commands, FrameSlot& slot) const {
  weighted_->record_solve(commands, slot);
  record_rest_level(commands, slot);
}

bool GradientSurface::expects_weights(const Frame& frame) const {
  if (!may_weigh()) return false;
  const std::optional<bool> lowered = confidence_->lowered_by(frame);
  if (!lowered) return last_weighed_;
  return *lowered || (confidence_->still_unknown_px() > 0 && !surface_.solves_known_part());
}

void GradientSurface::solve(FrameSlot& slot) {
  if (weighted_) {
    weighted_->solve(slot, dct_ ? heights(slot) : HeightRows{});
    last_weighed_ = may_weigh() && slot.surface.weighted.used;
  }
  if (!dct_) return;
  if (!slot.surface.weighted.used) {
    slot.surface.right_side.invalidate();
    dct_->solve(slot.surface.right_side.as<float>().data(), heights(slot).values.data(), grid_.pitch * 4);
  }
  slot.surface.changed = true;
}

SurfacePart GradientSurface::measure(const FrameSlot& slot, const ContactTouch& whole) const {
  SurfacePart part{.summary = measure_heights(slot), .faults = {}};
  slot.surface.clipped.invalidate();
  part.summary.clipped_px = slope_.clipped_px(slot.surface.clipped.as<const uint32_t>());
  const bool touched = whole.area_px > 0;
  part.faults.saturated = touched && too_many_saturated(whole);
  part.faults.clipped = touched && too_many_clipped(whole, part.summary.clipped_px, sensor_);
  if (weighted_) weighted_->measure(slot.surface.weighted, touched, part);
  return part;
}

void GradientSurface::add_times(const FrameSlot& slot, std::vector<gpu::ScopeTime>& times) const {
  if (weighted_) weighted_->add_times(slot.surface.weighted, times);
}

uint64_t GradientSurface::memory_bytes() const {
  return surface_.memory_bytes() + (weighted_ ? weighted_->memory_bytes() : 0);
}

}  // namespace palpate
