// Whether a press's maps lie on each other.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "engine/lump/network/view.h"

namespace palpate::lump {

struct Slide {
  size_t load = 0;  ///< of PressedNodes::loads: the one that lies farthest from the others
  std::array<double, 2> shift_mm{};
  double distance_mm = 0, sd_mm = 0;  ///< standard error, of noise and of how bumps change with the load
};

/// By least squares of each load's map on the highest one's and its slopes, against the loads' middle shift.
/// None of a single load, or where nothing in the map is steep enough.
std::optional<Slide> find_slide(const Model& model, const PressedNodes& nodes);

}  // namespace palpate::lump
