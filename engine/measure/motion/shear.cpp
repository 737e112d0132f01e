#include "engine/measure/motion/shear.h"

#include <cmath>
#include <utility>

namespace palpate {
namespace {
// Model error of a force by the skin: Cattaneo's shape, and the mean over a window.
constexpr double kSkinModelError = 0.02;
constexpr double kSlipError_px = 0.03;      // least error of a step of the contact's centre
constexpr uint32_t kLeastPoints = 5;        // under a contact, to see whether it slides
constexpr double kRimSlips = 0.85;          // share of the radius that sticks, below which slip is incipient
constexpr double kRimSticks = 0.87;         // and from which it is so no more
constexpr double kRimSeen = 0.8;            // the same share, as the skin shows it
constexpr double kForceKnown = 2;           // times its standard error: a lighter touch has no known limit
constexpr double kCentroidError_px = 0.05;  // one sigma; the synthetic sensor's tests hold twice that
}  // namespace

void ShearTracker::interrupt() {
  in_contact_ = false;
  interrupted_ = true;
}

// A tangential force, held at the friction limit where there is one.
struct ShearTracker::Force {
  double x_N = 0, y_N = 0;
  double size_N = 0;                   // before the limit
  double limit_N = 0, limit_sd_N = 0;  // the error only where the force is held at the limit
  Slip slip = Slip::Stick;

  Force(const ShearCalibration& c, double shift_x_mm, double shift_y_mm, const Estimate& normal_N)
      : x_N(c.kx_N_per_mm * shift_x_mm), y_N(c.ky_N_per_mm * shift_y_mm), size_N(std::hypot(x_N, y_N)) {
    // Without a force there is no friction limit to detect slip by: the shear is then no better than its
    // shift.
    if (normal_N.validity == Validity::NotCalibrated) {
      slip = Slip::NotCalibrated;
    } else if (limit_N = c.friction * std::max(normal_N.value, 0.0); size_N >= limit_N) {
      const double scale = size_N > 0 ? limit_N / size_N : 0;
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
  slip_ = Slip::Stick;
  skin_seen_ = false;
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

std::optional<Slip> ShearTracker::judge(const ShearCalibration* c, const Force* force, double x_mm,
                                        double y_mm, const Touch& touch) {
  FrictionState now;
  now.time_s = static_cast<double>(touch.time_ns) * 1e-9;
  now.x_mm = x_mm;
  now.y_mm = y_mm;
  now.foot_seen = touch.skin.has_value();
  now.foot_x_mm = now.foot_seen ? x_mm - touch.skin->shift_x_mm.value : anchor_x_mm_;
  now.foot_y_mm = now.foot_seen ? y_mm - touch.skin->shift_y_mm.value : anchor_y_mm_;
  now.error_mm = kSlipError_px * pitch_mm_per_px_;
  if (force && !force->no_limit()) {
    now.limit_known = true;
    // Along the pull, where that is what makes the force.
    const bool by_skin = c->signal == ShearSignal::Skin;
    const double pull_mm = std::hypot(now.x_mm - now.foot_x_mm, now.y_mm - now.foot_y_mm),
                 pull_N = by_skin ? force->size_N : std::hypot(force->x_N, force->y_N);
    now.limit_mm = by_skin == now.foot_seen && pull_N > 0
                       ? force->limit_N * pull_mm / pull_N
                       : force->limit_N * 2 / (c->kx_N_per_mm + c->ky_N_per_mm);
  }
  const bool slides = slip_watch_.slides(now);
  // A light touch has no limit that is known: it is taken for what it was.
  if (now.limit_known && (touch.force_N.validity == Validity::BelowRange ||
                          touch.force_N.value < kForceKnown * touch.force_N.standard_error))
    return std::nullopt;
  if (slides) return Slip::Slip;
  const double share =
      now.limit_known ? std::cbrt(1 - std::min(force->size_N / std::max(force->limit_N, 1e-9), 1.0)) : 1;
  bool rim_slips = share < (slip_ == Slip::Incipient ? kRimSticks : kRimSlips);
  if (now.foot_seen) {
    const Estimate& seen = touch.skin->stick_share;
    rim_slips |= (seen.validity == Validity::Valid || seen.validity == Validity::OnsetUnseen) &&
                 seen.value + seen.standard_error < kRimSeen;
  }
  return rim_slips ? Slip::Incipient : Slip::Stick;
}

void ShearTracker::fill_shear(const ShearCalibration& c, double x_mm, double y_mm, Touch& touch) {
  const SkinMotion skin = touch.skin.value_or(SkinMotion{});
  const bool by_skin = c.signal == ShearSignal::Skin && skin.touching >= 3;
  if (slip_ == Slip::Slip && touch.skin && skin_seen_) {
    // Sliding of the contact over the skin does not shear the pad.
    anchor_x_mm_ += x_mm - skin.shift_x_mm.value - skin_x_mm_;
    anchor_y_mm_ += y_mm - skin.shift_y_mm.value - skin_y_mm_;
  }
  const Force force(c, by_skin ? skin.shift_x_mm.value : x_mm - anchor_x_mm_,
                    by_skin ? skin.shift_y_mm.value : y_mm - anchor_y_mm_, touch.force_N);
  if (force.at_limit() || by_skin) {
    anchor_x_mm_ = x_mm - force.x_N / c.kx_N_per_mm;
    anchor_y_mm_ = y_mm - force.y_N / c.ky_N_per_mm;
    anchor_at_border_ = touch.at_border;
  }
  // Until enough points lie under it a contact is taken to stick, and what lifts stays what it was.
  if (!touch.skin || skin.touching >= kLeastPoints)
    slip_ = judge(&c, &force, x_mm, y_mm, touch).value_or(slip_);
  touch.slip = force.no_limit() && !touch.skin ? Slip::NotCalibrated : slip_;
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
  if (calibration) {
    fill_shear(*calibration, x_mm, y_mm, touch);
  } else if (touch.skin) {
    if (touch.skin->touching >= kLeastPoints)
      slip_ = judge(nullptr, nullptr, x_mm, y_mm, touch).value_or(slip_);
    touch.slip = slip_;
  }
  skin_seen_ = touch.skin && touch.skin->touching >= 3;
  if (skin_seen_) {
    skin_x_mm_ = x_mm - touch.skin->shift_x_mm.value;
    skin_y_mm_ = y_mm - touch.skin->shift_y_mm.value;
  }
}

}  // namespace palpate
