// Does a sensor go with frames of a format, and has it what the asked outputs need?
#pragma once

#include <cstdint>

#include "palpate/sensor.h"

namespace palpate {

/// Throws Error(Failure::Sensor), which says what would do. `outputs` is a sum of Output values.
void check_fit(const Sensor& sensor, const FrameFormat& format, uint32_t outputs);

}  // namespace palpate
