// Tangential force from the shift of the centroid, with stick and slip distinguished.
#pragma once

#include <optional>

#include "engine/measure/motion/slip.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {

/// Follows one contact from its onset. While it sticks, F_t = K u with u the centroid's shift since onset
/// (Eq. 59-60). Where |F_t| would pass friction * F_z the contact slips: the force stays at that limit and
/// the anchor of u is dragged along, so that the force never grows without bound and falls at once when the
/// motion turns back.
///
/// A contact that rests at its limit sticks: SlipWatch says whether it slides. Below it the slip is incipient
/// once the part that sticks, (1 - Q / (mu P))^(1/3) of the radius (Cattaneo, Mindlin), falls below 0.85.
///
/// Where the skin is followed (Touch::skin) and enough of its points lie under the contact, its motion shows
/// slide and incipient slip, and with ShearSignal::Skin u is that of the skin: while the contact slides the
/// skin stays, bent by the friction. The limit holds all the same.
class ShearTracker {
 public:
  explicit ShearTracker(double pitch_mm_per_px) : pitch_mm_per_px_(pitch_mm_per_px) {}

  /// The next frame does not continue the last one: a contact in it has an unseen onset, and its shear counts
  /// from where it is first seen (Validity::OnsetUnseen).
  void interrupt();
  /// Fills shift, shear and slip of `touch` from its centroid, force and skin. Frames in order; a new contact
  /// is a new onset. `calibration` may be null: then only the shift is known.
  void update(const ShearCalibration* calibration, Touch& touch);

 private:
  struct Force;
  void begin(const Touch& touch, double x_mm, double y_mm, bool after_interruption);
  void fill_shear(const ShearCalibration& calibration, double x_mm, double y_mm, Touch& touch);
  /// Slip of this frame; nothing where too little is known of it.
  std::optional<Slip> judge(const ShearCalibration* calibration, const Force* force, double x_mm, double y_mm,
                            const Touch& touch);
  Validity validity_of(const Force& force, const Touch& touch) const;

  double pitch_mm_per_px_;
  SlipWatch slip_watch_;
  Slip slip_ = Slip::Stick;               // of the present contact
  double skin_x_mm_ = 0, skin_y_mm_ = 0;  // the contact less the skin's shift, of the frame before
  bool skin_seen_ = false;
  bool in_contact_ = false;
  bool interrupted_ = false;   // no frame since
  bool onset_unseen_ = false;  // of the present contact
  bool anchor_at_border_ = false;
  double onset_x_mm_ = 0, onset_y_mm_ = 0;
  double onset_x_px_ = 0, onset_y_px_ = 0;
  double anchor_x_mm_ = 0, anchor_y_mm_ = 0;
};

}  // namespace palpate
