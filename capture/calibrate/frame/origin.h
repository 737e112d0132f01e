// Origin of a calibration, as recorded in the sensor file.
#pragma once

#include <string>

#include "palpate/sensor.h"

namespace palpate {

/// Made now (UTC).
Origin origin_now(const std::string& from, const std::string& note);

}  // namespace palpate
