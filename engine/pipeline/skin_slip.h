// Skin slip: whether the object goes along with the skin under it, from the motions of both.
#pragma once

#include <deque>
#include <optional>

#include "engine/motion/pose_tracker.h"
#include "engine/motion/slip_witness.h"
#include "palpate/touch.h"

namespace palpate {

class SkinSlip {
 public:
  /// Fills on_skin and slip_mm of touch.object, frames in order. `pose`: the same frame's; Touch::skin may be
  /// missing. Of several contacts the skin's motion is no single one, and nothing is known.
  void follow(const Pose& pose, Touch& touch);

 private:
  struct Moment {
    uint32_t track = 0;
    RigidMotion object;
    Matrix6d covariance, since_key;
    SkinMotion skin;
  };
  SlipWitness witness(const Moment& from, const Moment& to, const Pose& pose) const;

  /// When they last stuck, and the last few frames, the newest at the end.
  std::optional<Moment> stuck_;
  std::deque<Moment> recent_;
};

}  // namespace palpate
