#include "engine/pipeline/history.h"

namespace palpate {

TouchHistory::TouchHistory(const Sensor& sensor, const FrameFormat& format, bool contacts)
    : sensor_(sensor), skin_(sensor.pitch_mm_per_px), shear_(sensor.pitch_mm_per_px) {
  if (contacts) contacts_.emplace(sensor, format);
}

// Shear needs the force and the skin's motion, and the contacts' sums replace those of the whole touch.
void TouchHistory::follow(Touch& touch, bool after_gap, std::span<const float> skin_sd_px) {
  if (after_gap) interrupt();
  if (sensor_.force) touch.force_N = force_.update(*sensor_.force, force_features(touch));
  if (touch.skin) follow_skin(touch, skin_sd_px);
  shear_.update(sensor_.shear ? &*sensor_.shear : nullptr, touch);
  if (contacts_) contacts_->update(touch, skin_sd_px);
}

void TouchHistory::interrupt() {
  force_.interrupt();
  skin_.interrupt();
  shear_.interrupt();
  if (contacts_) contacts_->interrupt();
}

void TouchHistory::follow_skin(Touch& touch, std::span<const float> skin_sd_px) {
  const Ellipse& e = touch.ellipse;
  const ContactOutline outline{touch.centroid_x_px, touch.centroid_y_px, e.major_px, e.minor_px, e.angle_rad};
  touch.skin = skin_.update(touch.contact ? &outline : nullptr, touch.skin_points, skin_sd_px);
}

}  // namespace palpate
