#include "engine/pipeline/history.h"

#include <algorithm>
#include <iterator>

#include "engine/base/numbers.h"

namespace palpate {

namespace {

template <typename Shape>
void forget_motion(Shape& shape) {
  shape.shift_x_mm = shape.shift_y_mm = shape.shift_x_px = shape.shift_y_px = kNaN;
  shape.shear_x_N = shape.shear_y_N = {0, 0, Validity::NotFollowed};
  shape.slip = Slip::NotCalibrated;
}

}  // namespace

TouchHistory::TouchHistory(const Sensor& sensor, const FrameFormat& format, bool contacts, bool separate)
    : sensor_(sensor), separate_(separate), skin_(sensor), shear_(sensor.pitch_mm_per_px) {
  if (contacts) contacts_.emplace(sensor, format);
}

// Shear needs the force and the skin's motion, and the contacts' sums replace those of the whole touch.
void TouchHistory::follow(Touch& touch, bool after_gap, std::span<const float> skin_sd_px) {
  if (separate_) return measure_alone(touch);
  if (after_gap) interrupt();
  if (sensor_.force) touch.force_N = force_.update(*sensor_.force, force_features(touch));
  if (touch.skin) follow_skin(touch, skin_sd_px);
  shear_.update(sensor_.shear ? &*sensor_.shear : nullptr, touch);
  if (contacts_) contacts_->update(touch, skin_sd_px);
}

void TouchHistory::measure_alone(Touch& touch) {
  interrupt();
  if (sensor_.force) touch.force_N = force_.update(*sensor_.force, force_features(touch));
  if (contacts_) contacts_->update(touch);
  forget_motion(touch);
  for (ContactTouch& contact : touch.contacts) forget_motion(contact);
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
