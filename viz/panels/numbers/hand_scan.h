// A scan by hand as it grows: its lines in the measurement panel, and its map.
#pragma once

#include <vector>

#include "engine/palpation/hand/growing_scan.h"
#include "viz/panels/numbers/press.h"
#include "viz/render/image/map_view.h"

namespace palpate::viz {

/// How many presses there are, what lies behind them, and each press with its place or why it is left out:
/// those that could not be read, then the newest first.
std::vector<PressRow> scan_rows(const ScanStatus& status);

/// Pressure at the highest load in kPa, the presses' middles as a way, and a circle of the estimated size
/// where there is one.
MapLook scan_look(const ScanStatus& status);

}  // namespace palpate::viz
