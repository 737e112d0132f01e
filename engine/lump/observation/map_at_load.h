// A press's map at a load between its own.
#pragma once

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// By the polynomial through the nearest four (or all) of its loads: pressure over load is smooth in the
/// load. `force_N`: within its own, or little beyond.
PressureMap map_at_load(const Observation& observation, double force_N);

}  // namespace palpate::lump
