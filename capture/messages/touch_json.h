// A measured frame as JSON for programs: every quantity with its unit, its standard error and its state.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "engine/grip/grip_quantities.h"
#include "engine/measure/measured_columns.h"
#include "palpate/touch.h"

namespace palpate {

/// One line: {"frame": 12, "time_s": 0.4, "stamp": {"sec", "nanosec"}, "force_N": {"value": 0.84, "unit":
/// "N", "standard_error": 0.01, "state": "valid"}, ..., "contacts": [...]}. Values with all digits, as
/// sessions hold them; null: none. A quantity without an error or a state of its own has no such key.
/// `stamp_ns`: time of exposure, CLOCK_REALTIME. `zeroed`: force and shear are less than they were measured
/// by a zero that somebody took; then there is a key "zeroed": true. `source`: file of the frame, where it
/// has one of its own.
std::string touch_json(const Touch& touch, MeasuredColumns columns, int64_t stamp_ns, bool zeroed = false,
                       std::string_view source = {});
/// JSON schema of these lines.
std::string touch_json_schema(MeasuredColumns columns);

/// A row of pairs.csv: {"stamp", "time_s": {"value": 0.4, "unit": "s"}, "left_frame": {"value": 12}, ...,
/// "grip_force_N": {"value", "unit", "standard_error", "state"}, ...}, with all digits; null: none. `zeroed`:
/// its forces are less than they were measured, as in touch_json().
std::string grip_json(const GripFrame& frame, int64_t stamp_ns, bool zeroed = false);
std::string grip_json_schema();

/// An event: {"frame", "time_s", "stamp", "event", "text"}.
struct EventMessage {
  uint64_t frame = 0;
  double time_s = 0;
  std::string kind, text;
};
std::string event_json(const EventMessage& event, int64_t stamp_ns);
std::string event_json_schema();

}  // namespace palpate
