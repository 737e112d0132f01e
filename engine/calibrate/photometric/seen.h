// Places and colours that a photometric calibration saw, with its errors there.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/calibrate/photometric/fit.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate::photometric {

/// Each ball's place and error; a press of known normals shows no depth. `held_out`: the same presses.
std::vector<PressError> press_errors(std::span<const PhotometricPress> presses,
                                     std::span<const HeldOutPress> held_out, const FrameFormat& format);

/// Colours of the pixels of known slope; none where a colour does not change.
std::optional<SeenColours> seen_colours(std::span<const PhotometricPress> presses);

}  // namespace palpate::photometric
