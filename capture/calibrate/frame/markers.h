// Printed markers on a pad's skin: pixels that a calibration leaves out, and the pattern that they make.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// Height x width, 1: a dot darker in every channel than what surrounds it, and a rim of two pixels around
/// it, of dots below six pixels of one. Empty where the image has no pattern of dots: fewer than eight, or
/// more than a third of the frame. Looks for dots up to twice the sensor's skin.size_px, or without one up to
/// 1/16 of the shorter side.
std::vector<uint8_t> find_markers(const Frame& frame, const Sensor& sensor);

/// The dots of an untouched image as a pattern: the median distance to the nearest other one, and the median
/// diameter at half of each one's darkness. None where there are fewer than eight whole ones, or where they
/// are no pattern: less than seven in ten as far apart, and as large, as the median within a quarter and
/// within a half.
std::optional<SkinPattern> marker_pattern(const Frame& untouched, const Sensor& sensor);

/// Both masks in one; either may be empty.
std::vector<uint8_t> either(std::vector<uint8_t> a, const std::vector<uint8_t>& b);

}  // namespace palpate
