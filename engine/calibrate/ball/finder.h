// Where a ball is pressed into the pad, from the picture alone: centre and radius of its contact to a
// fraction of a pixel, or why the picture is no press of one ball.
#pragma once

#include <cstdint>
#include <span>

#include "engine/calibrate/ball/press.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

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
