// Depth of a gray gel by the sensor's table (SurfaceReading::Lookup).
#pragma once

#include "palpate/sensor.h"

namespace palpate {

/// Depth at a filtered change, mm: straight between the points, 0 at and below the first, the last one's
/// depth beyond it.
double lookup_depth_mm(const LookupCalibration& lookup, double gray);

}  // namespace palpate
