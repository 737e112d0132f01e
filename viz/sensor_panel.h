// What is known of the sensor: each calibration, where it came from, its range, and what is missing.
#pragma once

#include <string>
#include <vector>

#include "engine/sensor.h"
#include "viz/layout.h"
#include "viz/view_state.h"

namespace palpate::viz {

/// One calibration in words.
struct CalibrationLine {
  const char* name;
  bool present = false;
  std::string what;    ///< figures with units; where absent, what would do
  std::string origin;  ///< from what, when; empty: not stated in the sensor file
};
std::vector<CalibrationLine> calibrations(const Sensor& sensor);

void sensor_panel(const ViewRect& around, float scale, const Sensor& sensor, ViewState& state);

}  // namespace palpate::viz
