// Plots of force and shear calibrations.
#pragma once

#include "capture/calibrate/force/force.h"
#include "capture/calibrate/force/shear.h"
#include "viz/report/plot.h"

namespace palpate {

/// Readings of both directions with their curves and the 95 % interval, and the residuals below.
Plot plot_of(const ForceOutcome& outcome);
/// Force against shift of both directions, with what was left out as slip, and the ratio to the normal force.
Plot plot_of(const ShearOutcome& outcome);

}  // namespace palpate
