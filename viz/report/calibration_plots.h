// Plots of force and shear calibrations, as gnuplot scripts.
#pragma once

#include <string>

#include "capture/calibrate/force.h"
#include "capture/calibrate/shear.h"
#include "viz/report/plot_script.h"

namespace palpate {

/// Readings of both directions with their curves and the 95 % interval, and the residuals below.
std::string plot_script(const ForceOutcome& outcome, PlotKind kind);
/// Force against shift of both directions, with what was left out as slip, and the ratio to the normal force.
std::string plot_script(const ShearOutcome& outcome, PlotKind kind);

}  // namespace palpate
