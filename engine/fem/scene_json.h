// A scene as JSON, keys with their units.
#pragma once

#include "engine/base/json.h"
#include "engine/fem/scene.h"

namespace palpate::fem {

/// Names as the command line spells them: flat, ball, pressure.
const char* to_string(Presser presser);

json::Value to_json(const Scene& scene);

}  // namespace palpate::fem
