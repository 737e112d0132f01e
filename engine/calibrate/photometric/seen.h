// What a photometric calibration saw: the places of its presses with their errors, and the colours.
#pragma once

#include <span>
#include <vector>

#include "engine/calibrate/photometric/fit.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate::photometric {

/// Of each ball; a press of known normals shows no depth. `held_out`: the same presses.
std::vector<PressError> press_errors(std::span<const PhotometricPress> presses,
                                     std::span<const HeldOutPress> held_out, const FrameFormat& format);

/// Of the pixels of known slope; none where a colour does not change.
std::optional<SeenColours> seen_colours(std::span<const PhotometricPress> presses);

}  // namespace palpate::photometric
