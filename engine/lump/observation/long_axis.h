// The axis along which a bump is longer.
#pragma once

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// Whether the bump at a place (mm from the block's middle) is longer along y than along x, at the highest
/// load; false where nothing was seen.
bool longer_along_y(const Observation& observation, double x_mm, double y_mm);

}  // namespace palpate::lump
