// Where a ball, a cone or a cylinder is pressed into the pad, from the picture alone: the place of its
// contact to a fraction of a pixel, or why the picture is no press of one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/calibrate/ball/press.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// Colour gel: inside the contact the normals are a sphere's, so each channel's change is linear in the
/// distance from the centre (and in 1 - n_z); beyond the rim the pad goes back as an elastic half space does,
/// faster by an exponential of its own. Centre, radius and decay by Levenberg-Marquardt, what is linear is
/// solved for inside it; robust weights. `mask` (height x width, 1: leave out, such as markers) may be empty.
/// Throws Error(Failure::Input) on formats that differ or have other than three channels.
/// A cone, round as a ball, has slopes of its own.
FoundBall find_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                    const BallSearch& search);

/// The same of a cylinder that lies on the pad: the distance from its axis counts, along which the change is
/// the same between its ends, or those of the frame.
FoundBall find_cylinder(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                        const BallSearch& search);

/// The shape that is searched. Refuses a cylinder or cone of which a ball of any size explains more.
FoundBall find_contact(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                       const BallSearch& search);

/// Contacts of a grid of equal balls that is pressed at once, each as of one ball, good or with its refusal;
/// that of the picture alone where nothing is pressed. Refuses dots that do not stand as far apart as the
/// grid's.
std::vector<FoundBall> find_dots(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                                 const BallSearch& search);

/// Gray gel, whose change (by `signal`, brighter or darker) grows with depth: the contact is where the
/// filtered change passes the threshold, found along rays, with a circle fitted to them robustly.
FoundBall find_gray_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                         Signal signal, const BallSearch& search);

}  // namespace palpate
