// Reports of what lies in a block of tissue: of one estimate, and of each press.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/base/facts.h"
#include "engine/lump/observation/observation.h"
#include "engine/palpation/press_monitor.h"

namespace palpate {

/// A quantity of a lump with its 90 % interval.
struct EstimateQuantity {
  const char* name;
  const char* label;
  lump::Value value;
  const char* unit;     ///< empty: none
  const char* of_what;  ///< the unit in the text's table, and where it counts from
};
std::array<EstimateQuantity, 5> quantities_of(const lump::Estimate& estimate);

/// An object of value, low and high.
json::Value interval_json(const lump::Value& value);

/// An object of depth_mm, stiffness_ratio and size_mm, which is null where none is seen.
json::Value limit_json(const lump::DetectionLimit& limit);

/// Each lump that was estimated: both of two, the one there is where its numbers may be shown, none.
std::vector<lump::Estimate> lumps_of(const lump::Estimate& estimate);
/// A row for each of them, with its verdict, shape and quantities.
std::string lumps_csv(const lump::Estimate& estimate);

/// Verdict, quantities, shape, notes, effects of errors of the inputs, method.
Facts facts_of(const lump::Estimate& estimate);

/// An array, one object a press.
json::Value to_json(const std::vector<PressAnswer>& presses);

}  // namespace palpate
