#include "engine/measure/motion/shear.h"

#include <cmath>
#include <utility>

namespace palpate {
namespace {
// Model error of a force by the skin: Cattaneo's shape, and the mean over a window.
constexpr double kSkinModelError = 0.02;
constexpr double kLeastLoad = 0.7;          // of the friction limit, for a slide
constexpr double kCentroidError_px = 0.05;  // one sigma; the synthetic sensor's tests hold twice that
}  // namespace

void ShearTracker::interrupt() {
  in_contact_ = false;
  interrupted_ = true;
}

// A tangential force, held at the friction limit where there is one.
struct ShearTracker::Force {
  double x_N = 0, y_N = 0;
  double size_N = 0;      // before the limit
  double limit_sd_N = 0;  // of the limit, where the force is held at it
  Slip slip = Slip::Stick;

  Force(const ShearCalibration& c, double shift_x_mm, double shift_y_mm, const Estimate& normal_N)
      : x_N(c.kx_N_per_mm * shift_x_mm), y_N(c.ky_N_per_mm * shift_y_mm), size_N(std::hypot(x_N, y_N)) {
    // Without a force there is no friction limit to detect slip by: the shear is then no better than its
    // shift.
    if (normal_N.validity == Validity::NotCalibrated) {
      slip = Slip::NotCalibrated;
    } else if (const double limit = c.friction * std::max(normal_N.value, 0.0); size_N >= limit) {
      const double scale = size_N > 0 ? limit / size_N : 0;
      x_N *= scale;
      y_N *= scale;
      slip = Slip::Slip;
      limit_sd_N =
          std::hypot(c.friction * normal_N.standard_error, c.friction_sd * std::max(normal_N.value, 0.0));
    }
  }
  bool at_limit() const { return slip == Slip::Slip; }
  bool no_limit() const { return slip == Slip::NotCalibrated; }
};

void ShearTracker::begin(const Touch& touch, double x_mm, double y_mm, bool after_interruption) {
  in_contact_ = true;
  slip_watch_.restart();
  reported_ = Slip::Stick;
  onset_unseen_ = after_interruption;
  anchor_at_border_ = touch.at_border;
  onset_x_mm_ = anchor_x_mm_ = x_mm;
  onset_y_mm_ = anchor_y_mm_ = y_mm;
  onset_x_px_ = touch.centroid_x_px;
  onset_y_px_ = touch.centroid_y_px;
}

Validity ShearTracker::validity_of(const Force& force, const Touch& touch) const {
  // Clipped light makes the normal force a lower bound, and with it the limit that the shear is held at.
  if (force.at_limit() && touch.force_N.validity == Validity::Saturated) return Validity::Saturated;
  if (force.no_limit()) return Validity::NotCalibrated;
  // A contact that the frame cuts off has its centre elsewhere.
  if (anchor_at_border_ || touch.at_border) return Validity::AtBorder;
  return onset_unseen_ ? Validity::OnsetUnseen : Validity::Valid;
}

void ShearTracker::fill_shear(const ShearCalibration& c, double x_mm, double y_mm,
                              std::optional<Slip> reported, Touch& touch) {
  const SkinMotion skin = touch.skin.value_or(SkinMotion{});
  const bool by_skin = c.signal == ShearSignal::Skin && skin.touching >= 3;
  if (reported == Slip::Slip) {
    // Sliding of the contact over the skin does not shear the pad.
    anchor_x_mm_ += slip_watch_.apart_x_mm();
    anchor_y_mm_ += slip_watch_.apart_y_mm();
  }
  const Force force(c, by_skin ? skin.shift_x_mm.value : x_mm - anchor_x_mm_,
                    by_skin ? skin.shift_y_mm.value : y_mm - anchor_y_mm_, touch.force_N);
  touch.slip = force.slip;
  if (force.at_limit() || by_skin) {
    anchor_x_mm_ = x_mm - force.x_N / c.kx_N_per_mm;
    anchor_y_mm_ = y_mm - force.y_N / c.ky_N_per_mm;
    anchor_at_border_ = touch.at_border;
  }
  // Nothing slides far below the limit: there it is the outline that changes, as where a contact lifts.
  if (reported == Slip::Slip && !force.no_limit() && !force.at_limit() && by_skin &&
      force.size_N < kLeastLoad * c.friction * std::max(touch.force_N.value, 0.0))
    reported.emplace(Slip::Stick);
  // Until enough points lie under it a contact is taken to stick, and what lifts stays what it was.
  if (touch.skin) touch.slip = reported_ = reported.value_or(reported_);
  const double position_error_mm = kCentroidError_px * pitch_mm_per_px_;
  const Validity validity = validity_of(force, touch);
  const auto estimate = [&](double force_N, double stiffness, const Estimate& shift) {
    const double shift_error_mm = by_skin ? shift.standard_error : position_error_mm;
    const double relative = by_skin ? std::hypot(c.relative_sd, kSkinModelError) : c.relative_sd;
    return Estimate{force_N, std::hypot(relative * force_N, stiffness * shift_error_mm, force.limit_sd_N),
                    validity};
  };
  touch.shear_x_N = estimate(force.x_N, c.kx_N_per_mm, skin.shift_x_mm);
  touch.shear_y_N = estimate(force.y_N, c.ky_N_per_mm, skin.shift_y_mm);
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
  if (!in_contact_) begin(touch, x_mm, y_mm, after_interruption);
  touch.shift_x_mm = x_mm - onset_x_mm_;
  touch.shift_y_mm = y_mm - onset_y_mm_;
  touch.shift_x_px = touch.centroid_x_px - onset_x_px_;
  touch.shift_y_px = touch.centroid_y_px - onset_y_px_;
  std::optional<Slip> reported;
  if (touch.skin) reported = slip_watch_.update(x_mm, y_mm, *touch.skin);
  if (calibration)
    fill_shear(*calibration, x_mm, y_mm, reported, touch);
  else if (touch.skin)
    touch.slip = reported_ = reported.value_or(reported_);
}

}  // namespace palpate
