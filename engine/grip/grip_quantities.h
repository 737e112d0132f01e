// The list of a grip's quantities, as engine/measure/quantities.h has those of a touch: columns of pairs.csv.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/grip/grip.h"
#include "engine/measure/quantities.h"

namespace palpate {

/// A pair of frames of two fingers, or a frame without a partner, and what it says of the object.
struct GripFrame {
  int64_t time_ns = 0;                  ///< of exposure, of a pair the middle of both; 0 at the first
  std::optional<uint64_t> left, right;  ///< numbers of the frames
  std::optional<double> skew_ms;        ///< the right one was taken so much later
  std::optional<Grip> grip;             ///< of a pair
  Estimate opening_mm;                  ///< of the gripper, as it was told
};

// In the order of the columns.
std::span<const MeasuredQuantity<GripFrame>> grip_quantities();

}  // namespace palpate
