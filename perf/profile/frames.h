// Frames to time the pipeline with: what they cost to make does not matter, which tiles they touch does.
#pragma once

#include <cstdint>

#include "palpate/sensor.h"
#include "perf/profile/scene.h"

namespace palpate::perf {

/// `touched_fraction` of the frame's area is in contact: all of it, or a rectangle in the middle.
Scene timing_scene(uint32_t width_px, uint32_t height_px, Reconstruction reading, double touched_fraction);

}  // namespace palpate::perf
