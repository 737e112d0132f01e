// Slip witness: the object's motion beside the skin's, where the skin is followed.
#pragma once

#include <limits>

#include "engine/motion/pose_tracker.h"

namespace palpate {

/// The skin's motion under the contact, along the pad: mm, and radians from +x towards +y, with standard
/// errors. NaN: not known.
struct SkinDisplacement {
  double shift_mm[2] = {}, shift_sd_mm[2] = {};
  double turn_rad = std::numeric_limits<double>::quiet_NaN();
  double turn_sd_rad = std::numeric_limits<double>::quiet_NaN();
};

/// NaN where the object's or the skin's is.
struct SlipWitness {
  OnSkin on_skin = OnSkin::Unknown;
  double slip_mm[2] = {}, slip_sd_mm[2] = {};  ///< the object's shift less the skin's
  double turn_rad = 0, turn_sd_rad = 0;        ///< likewise about the normal
};

/// Of one way, over the same frames and seen at the same place (Pose::components(place_mm) of the contact's
/// middle). Both errors count as independent. The state is by the shifts, at 95 %; a disagreement takes 99 %.
SlipWitness slip_between(const PoseComponents& object, const SkinDisplacement& skin);

}  // namespace palpate
