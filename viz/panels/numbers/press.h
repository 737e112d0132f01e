// Presses of a block of tissue in the measurement panel.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/palpation/press_monitor.h"
#include "viz/look/theme.h"

namespace palpate::viz {

/// One line of it: what, and what of it; without a name it goes over the whole width.
struct PressRow {
  Meaning meaning = Meaning::Plain;
  std::string name;
  std::string value;
};

/// Lines of the panel, in order: the press in progress, then the result of the last one and its age at
/// `time_s`. Intervals hold the truth nine times out of ten. `by_hand`: the press in progress alone, since
/// one by itself has no result.
std::vector<PressRow> press_rows(const PressStatus& status, double time_s, bool by_hand = false);
/// What an estimate says.
void add_estimate(const lump::Estimate& estimate, std::vector<PressRow>& rows);

}  // namespace palpate::viz
