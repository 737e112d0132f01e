// Pictures of a series, looked at before the first of them is measured.
#pragma once

#include <functional>
#include <string>

#include "palpate/sensor.h"

namespace palpate {

class Pipeline;

/// Shows `pipeline`, which has its untouched image, up to 60 pictures of `input`, spread over it, whose
/// untouched image is a file's: together they say which light and which flaws each of them may hide under its
/// touch. Whoever measures separate pictures calls it before the first. `stop`: may be empty.
void look_ahead(const std::string& input, const Sensor& sensor, Pipeline& pipeline,
                const std::function<bool()>& stop);

}  // namespace palpate
