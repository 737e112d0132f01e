// Force, shear, depth and stick or slip over the last seconds: with units, error band, calibrated limits, one
// axis of time, and the events.
#pragma once

#include <deque>
#include <functional>

#include "palpate/sensor.h"
#include "viz/live/history.h"
#include "viz/live/tare.h"
#include "viz/panels/charts/time_axis.h"
#include "viz/render/layout.h"

struct ImDrawList;

namespace palpate::viz {

/// Draws into `rect`. Force: line, band of two standard errors, the calibrated range as dashed lines (without
/// a calibration the gray sum). Shear: x solid, y dashed, what the friction limit leaves as an area. Depth
/// where there is a surface. Where the rectangle is low the last charts are left out. `tare` moves force and
/// shear. The largest of what is shown is ringed, and stands with its time and what is in doubt above. Words
/// stand in rows of their own, none over a curve. No axis is shorter than six standard errors of what it
/// shows. At the cursor, of the mouse or of keys, a line goes through all charts, with its time and the
/// values there.
void draw_strip_charts(ImDrawList* list, const ViewRect& rect, const History& history, const Sensor& sensor,
                       const Tare& tare, const ChartStyle& style);

/// The largest value, also one in doubt, of the samples in a contact that lie within `shown`; null: there is
/// none.
const Sample* largest_of(const std::deque<Sample>& samples, const TimeSpan& shown,
                         const std::function<Estimate(const Sample&)>& value);

/// The least that the axis of shear reaches to either side, N: a twentieth of the largest friction limit, and
/// four standard errors, so that it does not show the noise of a pad at rest. The sensor has force and shear.
double least_shear_axis_N(const Sensor& sensor, const std::deque<Sample>& samples);

/// The forces between which a calibration was made, N: at the ends of its signal's range.
struct ForceRange {
  double least_N = 0, most_N = 0;
};
ForceRange calibrated_range(const ForceCalibration& force);

}  // namespace palpate::viz
