// Hand answer: what presses by hand say together, as people see it.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/palpation/hand/hand_scan.h"
#include "engine/palpation/hand/press_reader.h"
#include "engine/palpation/scan.h"

namespace palpate {

/// A press by hand as people see it.
struct HandRow {
  std::string name;
  std::string left_out;                       ///< why; empty: it is in the map
  std::array<double, 2> at_mm{}, at_sd_mm{};  ///< the window's middle; errors against the first press
  double turn_deg = 0, turn_sd_deg = 0;       ///< from +x towards +y
  HandTilt tilt = {};                         ///< NaN where it is left out
};

struct HandAnswer {
  ScanAnswer scan;
  std::vector<HandRow> rows;  ///< of all presses, those that could not be read last
};

/// Places, map and estimate. Throws as hand_scan() does.
HandAnswer answer_by_hand(const HandRecording& recording, const HandScanOptions& options,
                          const lump::Estimator& estimator, uint64_t seed = 1);

}  // namespace palpate
