// Pad error: slopes that a calibration leaves wrong. They stay with the pad while an object moves.
#pragma once

#include "engine/motion/residual_noise.h"

namespace palpate {

/// What fields of slopes of `slope_sd` make of a motion by `way_mm` that was found, over `reach_mm` or, where
/// that is 0, alike over reaches from 3 to 48 px.
class PadError {
 public:
  PadError(double slope_sd, double reach_mm, double way_mm, double pitch_mm, double radius_mm);

  /// Slopes that the contact's own part of the pad may have: over a few pieces their mean square strays about
  /// the whole pad's, and an object that stays where it is shows the same ones in both frames.
  double slope_of_place() const;
  /// What they add to the noise of scores whose mean precision is this: two places of one field.
  ScoreNoise noise(double precision) const;

 private:
  double left(size_t reach) const;
  double mean_left() const;
  double pieces() const;

  double slope_sd_, pitch_mm_, radius_mm_, way_mm_;
  size_t first_ = 2, end_ = ScoreNoise::kReaches;  // reaches; a frame's filter leaves none of less than 3 px
};

}  // namespace palpate
