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
/// Where the skin is followed (Touch::skin) and enough of its points lie under the contact, stick,
/// incipient slip and slide are told by its motion, and with ShearSignal::Skin u is that of the skin: while
/// the contact slides the skin stays, bent by the friction. The limit holds all the same.
class ShearTracker {
 public:
  explicit ShearTracker(double pitch_mm_per_px)
      : pitch_mm_per_px_(pitch_mm_per_px), slip_watch_(pitch_mm_per_px) {}

  /// The next frame does not continue the last one: a contact in it has an unseen onset, and its shear counts
  /// from where it is first seen (Validity::OnsetUnseen).
  void interrupt();
  /// Fills shift, shear and slip of `touch` from its centroid, force and skin. Frames in order; a new contact
  /// is a new onset. `calibration` may be null: then only the shift is known.
  void update(const ShearCalibration* calibration, Touch& touch);

 private:
  struct Force;
  void begin(const Touch& touch, double x_mm, double y_mm, bool after_interruption);
  void fill_shear(const ShearCalibration& calibration, double x_mm, double y_mm, std::optional<Slip> reported,
                  Touch& touch);
  Validity validity_of(const Force& force, const Touch& touch) const;

  double pitch_mm_per_px_;
  SlipWatch slip_watch_;
  Slip reported_ = Slip::Stick;  // by the skin, of the present contact
  bool in_contact_ = false;
  bool interrupted_ = false;   // no frame since
  bool onset_unseen_ = false;  // of the present contact
  bool anchor_at_border_ = false;
  double onset_x_mm_ = 0, onset_y_mm_ = 0;
  double onset_x_px_ = 0, onset_y_px_ = 0;
  double anchor_x_mm_ = 0, anchor_y_mm_ = 0;
};

}  // namespace palpate
