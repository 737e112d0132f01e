// Text of numbers and states in the window: with unit and uncertainty, and never by colour alone.
#pragma once

#include <string>

#include "engine/base/text.h"
#include "palpate/touch.h"
#include "viz/look/theme.h"

namespace palpate::viz {

/// A number with as many decimals as a tick distance of `step` needs.
std::string tick_text(double value, double step);

/// Words for a state, and what they mean.
struct Verdict {
  const char* words;
  Meaning meaning;
};
/// Confidence in a force.
Verdict force_verdict(Validity validity);
Verdict slip_verdict(Slip slip);

/// Whether saturated pixels may have changed a number that is shown: the force, the depth or, where neither
/// is known, the gray sum.
bool saturation_matters(const Touch& touch);
/// The same of one contact, whose touch has a surface or not.
bool saturation_matters(const ContactTouch& contact, const Touch& touch);

/// "0.42 ± 0.02 mm" and why it may be wrong.
std::string depth_text(const SurfaceSummary& surface);
/// As much of `whole` as fits into `width` px of the present font, with dots where something is missing.
std::string shortened(const std::string& whole, float width);
/// Seconds as 1:02:03.4 or 2:03.4 from a minute on, else "3.4 s".
std::string time_text(double time_s);

}  // namespace palpate::viz
