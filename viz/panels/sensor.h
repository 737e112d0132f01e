// Panel of the sensor: each calibration, its origin, its range, and the missing ones.
#pragma once

#include <string>
#include <vector>

#include "palpate/sensor.h"
#include "palpate/touch.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// One calibration in words.
struct CalibrationLine {
  const char* name;
  bool present = false;
  std::string what;    ///< figures with units; where absent, what would do
  std::string origin;  ///< from what, when; empty: not stated in the sensor file
};
std::vector<CalibrationLine> calibrations(const Sensor& sensor);

/// Over the middle of `around`: force and shear as curves with the contacts of `touch` (as measured) on them,
/// and all calibrations in words.
void sensor_panel(const Layout& layout, float scale, const Sensor& sensor, const Touch& touch,
                  ViewState& state);

}  // namespace palpate::viz
