// Slip witness: the object's motion beside the skin's, where the skin is followed.
#pragma once

#include <limits>
#include <string_view>

#include "engine/motion/pose_tracker.h"

namespace palpate {

/// The skin's motion under the contact, along the pad: mm, and radians from +x towards +y, with standard
/// errors. NaN: not known.
struct SkinDisplacement {
  double shift_mm[2] = {}, shift_sd_mm[2] = {};
  double turn_rad = std::numeric_limits<double>::quiet_NaN();
  double turn_sd_rad = std::numeric_limits<double>::quiet_NaN();
};

enum class Grip {
  Unknown,  ///< no shift is known of both
  Stick,    ///< they move alike, within their errors
  Slip,     ///< the object goes on where the skin stays behind
  /// The skin goes farther than the object, across its way or back: the object's texture is the skin's or the
  /// pad's, a wave was missed, or the skin's points were lost. A skin that springs back after a slip does so,
  /// too: ways to hand over are those since it last stuck.
  Disagree
};
std::string_view name_of(Grip grip);

/// NaN where the object's or the skin's is.
struct SlipWitness {
  Grip grip = Grip::Unknown;
  double slip_mm[2] = {}, slip_sd_mm[2] = {};  ///< the object's shift less the skin's
  double turn_rad = 0, turn_sd_rad = 0;        ///< likewise about the normal
};

/// Of one way, over the same frames and seen at the same place (Pose::components(place_mm) of the contact's
/// middle). Both errors count as independent. The state is by the shifts, at 95 %; a disagreement takes 99 %.
SlipWitness slip_between(const PoseComponents& object, const SkinDisplacement& skin);

}  // namespace palpate
