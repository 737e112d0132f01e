#include "engine/pipeline/frame_measurement.h"

#include <cmath>
#include <numbers>

#include "engine/measure/contact_shape.h"
#include "engine/stages/elastic.h"
#include "engine/stages/gradient.h"
#include "engine/stages/skin.h"
#include "engine/stages/slope.h"

namespace palpate {
namespace {

// Whether so much of the contact is clipped that its depth cannot be right: a share of its area, and in the
// reading `shading` more than what the 5 x 5 filter leaves dark along its rim, whatever its slope.
bool too_many_clipped(const Touch& t, const Sensor& sensor) {
  constexpr double kShare = 0.01, kRim_px = 4;
  double allowed_px = kShare * static_cast<double>(t.area_px);
  if (sensor.reading == Reading::Shading) {
    // The circumference of an ellipse lies below that of the circle with the same root mean square of axes.
    const double across_px = std::hypot(t.ellipse.major_mm, t.ellipse.minor_mm) / sensor.pitch_mm_per_px;
    allowed_px += kRim_px * std::numbers::pi * across_px / std::numbers::sqrt2;
  }
  return static_cast<double>(t.clipped_px) > allowed_px;
}

}  // namespace

Measuring::Measuring(const Sensor& sensor, const FrameFormat& format, const Stages& stages)
    : sensor_(sensor),
      format_(format),
      stages_(stages),
      skin_tracker_(sensor.pitch_mm_per_px),
      shear_(sensor.pitch_mm_per_px) {
  if (stages_.regions) tracker_.emplace(sensor_, format_);
}

Touch Measuring::measure(const FrameSlot& slot) {
  slot.records.invalidate();
  const auto records = slot.records.as<const shared::ContactRecord>();
  const FramePlace& at = slot.place;
  const int64_t center_x = at.frame_width / 2, center_y = at.frame_height / 2;  // as in ContactMoments
  const ContactMoments m = moved(stages_.contact->sum(records), int64_t{at.x} + format_.width / 2 - center_x,
                                 int64_t{at.y} + format_.height / 2 - center_y);
  const ShapeScale scale{static_cast<double>(center_x), static_cast<double>(center_y),
                         sensor_.pitch_mm_per_px};
  Touch t;
  t.sequence = slot.sequence;
  t.time_ns = slot.time_ns;
  t.contact = m.area > 0;
  set_shape(t, m, scale);
  if (stages_.regions) measure_regions(slot, records, scale, t);
  if (stages_.gradient) {
    slot.gradient_sums.invalidate();
    const uint64_t units = stages_.gradient->sum(slot.gradient_sums.as<const uint32_t>());
    t.gradient_sum = static_cast<double>(units) / shared::kGradientUnits;
    t.has_gradient = true;
  }
  if (stages_.datum) {
    slot.datum_records.invalidate();
    const RestLevel rest = stages_.datum->rest_level(
        records, slot.datum_records.as<const shared::DatumRecord>(), slot.inner_edges(format_));
    t.has_surface = true;
    t.depth_datum_mm = -rest.level_mm;
    t.depth_max_mm = rest.highest_mm - rest.level_mm;
    t.datum_from_rest = rest.from_untouched;
    t.volume_mm3 = stages_.datum->volume_px_mm(records, slot.datum_records.as<const shared::DatumRecord>(),
                                               sensor_.reading == Reading::Elastic ? 0 : rest.level_mm) *
                   sensor_.pitch_mm_per_px * sensor_.pitch_mm_per_px;
    t.depth_validity = !t.contact           ? Validity::NoContact
                       : t.saturated_px > 0 ? Validity::Saturated
                                            : Validity::Valid;
    if (sensor_.reading == Reading::Elastic)
      measure_elastic(slot, rest, t);
    else if (sensor_.reading == Reading::Lookup)
      measure_lookup(rest, t);
    else
      measure_clipped(slot, t);
  }
  if (stages_.partial) stages_.partial->report(slot.known, t);
  if (slot.after_gap) force_.interrupt();
  if (sensor_.force) t.force_N = force_.update(*sensor_.force, force_reading(t));
  if (slot.after_gap) shear_.interrupt();
  if (stages_.skin) measure_skin(slot, t);
  shear_.update(sensor_.shear ? &*sensor_.shear : nullptr, t);
  if (tracker_) {
    if (slot.after_gap) tracker_->interrupt();
    tracker_->update(t, skin_sd_px_);
  }
  return t;
}

// Each region of the contact, not followed yet.
void Measuring::measure_regions(const FrameSlot& slot, std::span<const shared::ContactRecord> records,
                                const ShapeScale& scale, Touch& t) {
  const FramePlace& at = slot.place;
  t.has_contacts = true;
  t.regions_overflow = !stages_.regions->find(slot.parts, records, found_);
  for (const Region& region : found_) {
    ContactTouch& one = t.contacts.emplace_back();
    set_shape(one,
              moved(region.moments, int64_t{at.x} + format_.width / 2 - int64_t{at.frame_width / 2},
                    int64_t{at.y} + format_.height / 2 - int64_t{at.frame_height / 2}),
              scale);
    one.box = {region.box.x + at.x, region.box.y + at.y, region.box.width, region.box.height};
  }
}

void Measuring::measure_skin(const FrameSlot& slot, Touch& t) {
  slot.skin_records.invalidate();
  stages_.skin->read(slot.skin_records.as<const Skin::Motion>(), t.skin_points, skin_sd_px_);
  if (slot.after_gap) skin_tracker_.interrupt();
  const double per_px = 1 / sensor_.pitch_mm_per_px;
  const ContactOutline outline{t.centroid_x_px, t.centroid_y_px, t.ellipse.major_mm * per_px,
                               t.ellipse.minor_mm * per_px, t.ellipse.angle_rad};
  t.has_skin = true;
  t.skin = skin_tracker_.update(t.contact ? &outline : nullptr, t.skin_points, skin_sd_px_);
}

void Measuring::measure_clipped(const FrameSlot& slot, Touch& t) const {
  slot.clipped.invalidate();
  t.clipped_px = stages_.slope->clipped_px(slot.clipped.as<const uint32_t>());
  if (t.depth_validity == Validity::Valid && too_many_clipped(t, sensor_))
    t.depth_validity = Validity::Clipped;
}

// Depth by pressure is absolute: there is no rest level to be found_.
void Measuring::measure_elastic(const FrameSlot& slot, const RestLevel& map_level, Touch& t) const {
  slot.border_records.invalidate();
  t.depth_datum_mm = 0;
  t.depth_max_mm = map_level.highest_mm;
  t.datum_from_rest = true;
  t.depth_sd_mm = sensor_.elastic.relative_sd * std::abs(t.depth_max_mm);
  if (t.contact && Elastic::touches_border(slot.border_records.as<const float>()))
    t.depth_validity = Validity::AtBorder;
  if (t.contact && (t.saturated_px > 0 || t.peak_gray > Elastic::largest_readable_gray(sensor_.elastic)))
    t.depth_validity = Validity::Saturated;
}

// So is depth by a table.
void Measuring::measure_lookup(const RestLevel& map_level, Touch& t) const {
  t.depth_datum_mm = 0;
  t.depth_max_mm = map_level.highest_mm;
  t.datum_from_rest = true;
  t.depth_sd_mm = sensor_.lookup.depth_sd_mm;
  if (t.depth_validity == Validity::Valid && t.peak_gray > sensor_.lookup.points.back()[0])
    t.depth_validity = Validity::AboveRange;
}

}  // namespace palpate
