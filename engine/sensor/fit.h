// Check that a sensor fits the frames' format and has everything that the requested outputs need.
#pragma once

#include <cstdint>

#include "palpate/options.h"
#include "palpate/sensor.h"

namespace palpate {

/// Whether the sensor's gray is a pressure, pixel by pixel.
inline bool reads_pressure(const Sensor& sensor) {
  return sensor.reading == SurfaceReading::Elastic && sensor.channels == 1;
}

/// Whether the skin is followed: where it is asked for, and where shear is calibrated by it.
inline bool follows_skin(const Sensor& sensor, bool wants_skin, bool wants_force) {
  return wants_skin ||
         (wants_force && sensor.skin && sensor.shear && sensor.shear->signal == ShearSignal::Skin);
}

/// Whether each pixel's confidence is measured: where it is asked for, and where a surface may have to do
/// without some pixels.
inline bool needs_confidence(const Sensor& sensor, Outputs outputs) {
  return wants(outputs, Output::Confidence) ||
         (wants(outputs, Output::Surface) && (sensor.pad || sensor.shadow_gray));
}

/// Whether changes of a gel's light are followed and taken out. Among printed markers, which move, they are
/// not; there frames under another light say that it is unknown.
inline bool follows_light(const Sensor& sensor) {
  return has_gel_contacts(sensor) && !(sensor.skin && sensor.skin->kind == SkinKind::Markers);
}

/// Whether places where the untouched image no longer holds can be found. Printed markers move, and a
/// waveguide's dust glows as a touch does.
inline bool shows_flaws(const Sensor& sensor) {
  return sensor.background.kind == BackgroundKind::Untouched && sensor.bit_depth == 8 &&
         !(sensor.skin && sensor.skin->kind == SkinKind::Markers) &&
         (sensor.reading == SurfaceReading::Photometric || sensor.reading == SurfaceReading::Lookup);
}

/// Throws Error(Failure::Sensor), which says what would do.
void check_fit(const Sensor& sensor, const FrameFormat& format, Outputs outputs);

}  // namespace palpate
