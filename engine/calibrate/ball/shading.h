// Size of a pressed ball by the shading under it, which depends on neither its stated radius nor the scale.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/calibrate/ball/press.h"
#include "palpate/frame.h"

namespace palpate {

/// Curvature of what is pressed, 1 / px^2: one over the square of the radius in px of the ball, or of
/// the cylinder. A matt skin that
/// is tilted darkens by Lambert's law in all colours alike, whatever the lights' directions, by its
/// brightness times 1 - n_z = r^2 / (2 R^2); what the lights add or take on one side is linear in x and y and
/// does not count. Light that does not come from the lights, and cameras that compress brightness, make the
/// curvature too small: on real gels it was 0.5 to 1.1 of the true one, in the simulator 1. Nothing where
/// fewer than 200 pixels of the contact can be used. Frames have three channels.
std::optional<double> shaded_curvature_per_px2(const Frame& frame, const Frame& background,
                                               std::span<const uint8_t> mask, const FoundBall& ball);

}  // namespace palpate
