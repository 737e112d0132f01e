// Verdict on a force calibration: how good it is, whether it is fit for use, and what would make it better.
#pragma once

#include <string>

#include "capture/calibrate/force.h"

namespace palpate {

/// A calibration is not fit for use where its interval is wider than kWorstInterval of full scale, where it
/// rests on fewer than kFewestReadings, or where its full scale is less than kLeastReach of what was pressed.
struct ForceVerdict {
  static constexpr double kWorstInterval = 0.3;
  static constexpr size_t kFewestReadings = 20;
  static constexpr double kLeastReach = 0.5;

  bool fit_for_use = true;
  double interval_fraction = 0;  ///< half the 95 % interval at full scale, over full scale
  double reach = 1;              ///< full scale over the gauge's largest reading while something touches
  size_t presses = 0;            ///< that the fit used
  std::string line;              ///< "good to 3.1 % of full scale ..." or "not fit for use: ..."; one line
};

ForceVerdict verdict_of(const ForceOutcome& outcome);

}  // namespace palpate
