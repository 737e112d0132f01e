#include "engine/measure/shear.h"

#include <cmath>
#include <utility>

namespace palpate {
namespace {
// Of a force by the skin: how far Cattaneo's shape and a window's mean are right.
constexpr double kSkinModelError = 0.02;
constexpr double kLeastLoad = 0.7;          // of the friction limit, for a slide
constexpr double kCentroidError_px = 0.05;  // one sigma; the synthetic sensor's tests hold twice that
}  // namespace

void ShearTracker::interrupt() {
  in_contact_ = false;
  interrupted_ = true;
}

void ShearTracker::update(const ShearCalibration* calibration, Touch& touch) {
  const bool after_interruption = std::exchange(interrupted_, false);
  if (!touch.contact) {
    in_contact_ = false;
    slip_watch_.restart();
    touch.slip = calibration ? Slip::NoContact : Slip::NotCalibrated;
    const Validity validity = calibration ? Validity::NoContact : Validity::NotCalibrated;
    touch.shear_x_N = touch.shear_y_N = {0, 0, validity};
    return;
  }
  const double x_mm = touch.centroid_x_px * pitch_mm_per_px_;
  const double y_mm = touch.centroid_y_px * pitch_mm_per_px_;
  if (!in_contact_) {
    in_contact_ = true;
    slip_watch_.restart();
    reported_ = Slip::Stick;
    onset_unseen_ = after_interruption;
    anchor_at_border_ = touch.at_border;
    onset_x_mm_ = anchor_x_mm_ = x_mm;
    onset_y_mm_ = anchor_y_mm_ = y_mm;
  }
  touch.shift_x_mm = x_mm - onset_x_mm_;
  touch.shift_y_mm = y_mm - onset_y_mm_;
  std::optional<Slip> reported;
  if (touch.skin) reported = slip_watch_.update(x_mm, y_mm, *touch.skin);
  if (!calibration) {
    if (touch.skin) touch.slip = reported_ = reported.value_or(reported_);
    return;
  }

  const ShearCalibration& c = *calibration;
  const SkinMotion skin = touch.skin.value_or(SkinMotion{});
  const bool by_skin = c.signal == ShearSignal::Skin && skin.touching >= 3;
  if (reported == Slip::Slip) {
    // What the contact travels over the skin bends nothing.
    anchor_x_mm_ += slip_watch_.apart_x_mm();
    anchor_y_mm_ += slip_watch_.apart_y_mm();
  }
  double fx = c.kx_N_per_mm * (by_skin ? skin.shift_x_mm.value : x_mm - anchor_x_mm_);
  double fy = c.ky_N_per_mm * (by_skin ? skin.shift_y_mm.value : y_mm - anchor_y_mm_);
  const double size = std::hypot(fx, fy);
  touch.slip = Slip::Stick;
  double limit_error = 0;
  // Without a force there is no friction limit to tell slip by: the shear is then no better than its shift.
  if (touch.force_N.validity == Validity::NotCalibrated) {
    touch.slip = Slip::NotCalibrated;
  } else if (const double limit = c.friction * std::max(touch.force_N.value, 0.0); size >= limit) {
    const double scale = size > 0 ? limit / size : 0;
    fx *= scale;
    fy *= scale;
    touch.slip = Slip::Slip;
    limit_error = std::hypot(c.friction * touch.force_N.standard_error,
                             c.friction_sd * std::max(touch.force_N.value, 0.0));
  }
  const bool at_limit = touch.slip == Slip::Slip, no_limit = touch.slip == Slip::NotCalibrated;
  if (at_limit || by_skin) {
    anchor_x_mm_ = x_mm - fx / c.kx_N_per_mm;
    anchor_y_mm_ = y_mm - fy / c.ky_N_per_mm;
    anchor_at_border_ = touch.at_border;
  }
  // Nothing slides far below the limit: there it is the outline that changes, as where a contact lifts.
  if (reported == Slip::Slip && !no_limit && !at_limit && by_skin &&
      size < kLeastLoad * c.friction * std::max(touch.force_N.value, 0.0))
    reported.emplace(Slip::Stick);
  // Until enough points lie under it a contact is taken to stick, and what lifts stays what it was.
  if (touch.skin) touch.slip = reported_ = reported.value_or(reported_);
  const double position_error_mm = kCentroidError_px * pitch_mm_per_px_;
  Validity validity = Validity::Valid;
  if (no_limit) validity = Validity::NotCalibrated;
  // Clipped light makes the normal force a lower bound, and with it the limit that the shear is held at.
  if (at_limit && touch.force_N.validity == Validity::Saturated) validity = Validity::Saturated;
  // A contact that the frame cuts off has its centre elsewhere.
  if (validity == Validity::Valid && (anchor_at_border_ || touch.at_border)) validity = Validity::AtBorder;
  if (onset_unseen_ && validity == Validity::Valid) validity = Validity::OnsetUnseen;
  const auto estimate = [&](double force, double stiffness, const Estimate& shift) {
    const double shift_error_mm = by_skin ? shift.standard_error : position_error_mm;
    const double relative = by_skin ? std::hypot(c.relative_sd, kSkinModelError) : c.relative_sd;
    return Estimate{force, std::hypot(relative * force, stiffness * shift_error_mm, limit_error), validity};
  };
  touch.shear_x_N = estimate(fx, c.kx_N_per_mm, skin.shift_x_mm);
  touch.shear_y_N = estimate(fy, c.ky_N_per_mm, skin.shift_y_mm);
}

}  // namespace palpate
