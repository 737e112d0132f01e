// Verdict on presses of a ball before anything is fitted to them: which were left out and why, and whether
// their circles and their shading agree with the size of the ball and the scale that were stated.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "capture/calibrate/photometric/ball_size.h"
#include "capture/calibrate/photometric/presses.h"
#include "engine/base/json.h"

namespace palpate {

/// Pictures in which something is pressed: used and left out.
struct PressSelection {
  size_t presses = 0;   ///< used
  size_t pictures = 0;  ///< in which something is pressed
  size_t left_out = 0;  ///< of them
  std::map<BallRefusal, size_t> reasons;

  /// More pictures were left out than not.
  bool minority() const { return 2 * left_out > pictures; }
};
PressSelection selection_of(const BallPresses& found);
/// "22 presses; of 24 pictures of a press 2 left out (1 at the frame's border, 1 unlike the others)".
std::string describe(const PressSelection& selection);
json::Value to_json(const PressSelection& selection);

/// Throws Error(Failure::Input) where what was left out contradicts the ball's radius or the scale, so that
/// an error on the rest would mislead: half of the presses or more are wider than the ball, or some are whose
/// colour changes as fast as the others' (the same ball); or half or more are unlike the others.
void refuse_contradictions(const BallPresses& found, const Sensor& sensor, const std::string& input);

/// Evidence on the ball's size that does not depend on the size that was stated.
struct BallEvidence {
  PressedShape shape{};          ///< the balls' own where there is one size
  double radius_mm = 0;          ///< as stated; the median where a table states several
  double least_contact_mm = 0;   ///< radius or half width of the smallest contact
  double widest_contact_mm = 0;  ///< of the widest
  double widest_share = 0;       ///< of its ball's radius, at most 1
  /// Darkening under the contacts over that under balls of the stated radius (shading.h): at the right radius
  /// 0.5 to 1.1, at its double four times that. 0 where `judged` is 0.
  double shading = 0, shading_sd = 0;
  double least_shading = 0;  ///< nine presses of ten read more
  size_t judged = 0;         ///< presses whose shading was read: of colour gels

  /// Radius by the shading alone, mm; 0 where it gives none.
  double shaded_radius_mm() const;
};
/// Evidence of the presses of balls, or of those of another shape.
BallEvidence evidence_of(const BallPresses& found, const Sensor& sensor, const PressedShape& of = {});

/// Doubt about the size of the ball.
struct BallDoubt {
  enum class Kind { None, Diameter, TooLarge, TooSmall } kind = Kind::None;
  bool refused = false;
  std::string line{};  ///< for people; empty: no doubt
};
/// A radius and a diameter differ in the shading. Refused: a size that is several times too large whatever
/// the pad, and a diameter that was given by the older option. `size` may be empty (presses by a table).
BallDoubt doubt_of(const BallEvidence& evidence, const BallSize& size);
/// Throws Error(Failure::Input) where the doubt is a refusal.
void refuse_doubtful(const BallDoubt& doubt, const BallEvidence& evidence, const BallSize& size,
                     const std::string& input);

/// "contacts of 1.01 to 1.91 mm radius on a ball of 2.92 mm radius (35 to 65 % of it); shading alone: a ball
/// of 2.8 mm radius".
std::string describe(const BallEvidence& evidence);
json::Value to_json(const BallEvidence& evidence);

}  // namespace palpate
