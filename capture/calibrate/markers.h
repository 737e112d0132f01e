// Mask of the printed markers on a pad's skin: pixels that a calibration leaves out.
#pragma once

#include <cstdint>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// Height x width, 1: a dot darker in every channel than what surrounds it, and a rim of two pixels around
/// it. Empty where the image has no pattern of dots: fewer than eight, or more than a third of the frame.
/// Looks for dots up to twice the sensor's skin.size_px, or without one up to 1/16 of the shorter side.
std::vector<uint8_t> find_markers(const Frame& frame, const Sensor& sensor);

/// Both masks in one; either may be empty.
std::vector<uint8_t> either(std::vector<uint8_t> a, const std::vector<uint8_t>& b);

}  // namespace palpate
