// Frames to time the pipeline with; the cost of making them does not matter, the tiles that they touch do.
#pragma once

#include <cstdint>

#include "palpate/sensor.h"
#include "perf/profile/scene.h"

namespace palpate::perf {

/// Of a frame's area, touched by what people press.
constexpr double kUsualTouch = 0.1;

/// Pictures with a camera's noise. `touched_fraction` of the frame's area is in contact: all of it, or a
/// rectangle in the middle.
Scene timing_scene(uint32_t width_px, uint32_t height_px, SurfaceReading reading, double touched_fraction);

}  // namespace palpate::perf
