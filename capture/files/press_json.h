// JSON of presses of a block of tissue.
#pragma once

#include <string>
#include <vector>

#include "engine/palpation/press_monitor.h"

namespace palpate {

/// A JSON array (text), one object a press.
std::string to_json(const std::vector<PressAnswer>& presses);

}  // namespace palpate
