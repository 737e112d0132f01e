// How fast presses of one ball change the colour across their contacts.
#pragma once

#include <span>
#include <vector>

#include "engine/calibrate/ball/press.h"
#include "palpate/frame.h"

namespace palpate {

/// The ramp (FoundBall::ramp_per_px) to expect at each ball's place: the median of all or, of 18 or
/// more, a quadratic in place through their logarithms by least absolute differences, as light falls off over
/// the pad.
std::vector<double> usual_ramps(std::span<const FoundBall> balls, const FrameFormat& format);

}  // namespace palpate
