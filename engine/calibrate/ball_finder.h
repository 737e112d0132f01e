// Where a ball is pressed into the pad, from the picture alone: centre and radius of its contact to a
// fraction of a pixel, or why the picture is no press of one ball.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// A ball's contact, px of the rectified frame. With a refusal the numbers are what the search ended with.
struct FoundBall {
  double center_x_px = 0;
  double center_y_px = 0;
  double radius_px = 0;     ///< of the contact, where the pad leaves the ball
  double center_sd_px = 0;  ///< standard error along x or y, from the fit's residuals
  double radius_sd_px = 0;
  double explained = 0;         ///< share of the change around the contact that one ball explains, 0 to 1
  double ramp_gray_per_px = 0;  ///< colour: how fast the change grows across the contact; the same for every
                                ///< press of one ball where the light is even
  std::string refusal;          ///< why this is no press of one ball; empty: it is

  bool good() const { return refusal.empty(); }
};

struct BallSearch {
  double ball_radius_mm = 0;
  double pitch_mm_per_px = 0;
  double threshold_gray = 0;  ///< least filtered change that counts as touch; 0: from the picture's noise
};

/// Colour gel: inside the contact the normals are a sphere's, so each channel's change is linear in the
/// distance from the centre (and in 1 - n_z); beyond the rim the pad goes back as an elastic half space does,
/// faster by an exponential of its own. Centre, radius and decay by Levenberg-Marquardt, what is linear is
/// solved for inside it; robust weights. `mask` (height x width, 1: leave out, such as markers) may be empty.
/// Throws Error(Failure::Input) on formats that differ or have other than three channels.
FoundBall find_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                    const BallSearch& search);

/// Gray gel, whose change (by `signal`, brighter or darker) grows with depth: the contact is where the
/// filtered change passes the threshold, found along rays, with a circle fitted to them robustly.
FoundBall find_gray_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                         Signal signal, const BallSearch& search);

}  // namespace palpate
