// Presses of a data set's block on a stage, as a scan has them.
#pragma once

#include <array>
#include <vector>

#include "engine/lump/observation/scan_stitch.h"
#include "engine/lump/observation/sensor_model.h"
#include "engine/palpation/hand/held_pad.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

/// The stage's error along x and along y, mm, and the hardest press.
inline constexpr double kStudyStage_mm = 0.1, kHardest_N = 1.6;

/// The block of another modulus, such that its hardest press is one of `hardest_N`: forces and pressures are
/// in proportion to it.
PressedTissue tissue_of(const Example& example, double hardest_N);

/// A level plate on a stage, at each place, up to `top_N`; a window's size is the sensor's. Deterministic by
/// seed, and the first presses are the same however many follow.
std::vector<ScanPress> staged_presses(const PressedTissue& tissue,
                                      const std::vector<std::array<double, 2>>& places_mm, double top_N,
                                      const PalpationSensor& sensor, uint64_t seed);

}  // namespace palpate::lump
