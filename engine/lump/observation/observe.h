// An observation from pressure maps in any order.
#pragma once

#include <vector>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// Maps and the forces at which they were seen, brought into the order of rising forces; noise from the last
/// map's roughness, and what is saturated there. Block, window and modulus stay to be set. Throws
/// Error(Failure::Usage) where there is not one force for each map.
Observation observe(std::vector<PressureMap> pressure_Pa, const std::vector<double>& force_N);

}  // namespace palpate::lump
