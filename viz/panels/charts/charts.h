// Force, shear, depth and stick or slip over the last seconds: with units, error band, calibrated limits, one
// axis of time, and the events.
#pragma once

#include <deque>
#include <optional>

#include "palpate/sensor.h"
#include "viz/live/history.h"
#include "viz/live/tare.h"
#include "viz/render/layout.h"

struct ImDrawList;

namespace palpate::viz {

/// Appearance of the charts.
struct ChartStyle {
  double span_s = 10;  ///< of the time axis where it does not show a whole recording
  bool whole = true;   ///< recordings in which the person can jump are shown from end to end
  float scale = 1;     ///< of text
};

/// Draws into `rect`. Force: line, band of two standard errors, the calibrated range as dashed lines (without
/// a calibration the gray sum). Shear: x solid, y dashed, what the friction limit leaves as an area. Depth
/// where there is a surface. Where the rectangle is low the last charts are left out. `tare` moves force and
/// shear. Words stand in rows of their own, none over a curve.
void draw_strip_charts(ImDrawList* list, const ViewRect& rect, const History& history, const Sensor& sensor,
                       const Tare& tare, const ChartStyle& style);

/// The time on the axis under a place `x` (px) of the picture; none outside the charts.
std::optional<double> time_under(float x, const ViewRect& rect, const History& history,
                                 const ChartStyle& style);

/// The least that the axis of shear reaches, N: a twentieth of the largest friction limit, and four standard
/// errors, so that it does not show the noise of a pad at rest. The sensor has force and shear.
double least_shear_axis_N(const Sensor& sensor, const std::deque<Sample>& samples);

/// Distance of the ticks of an axis from `least` (0 or below) to `most` (above it): room for `ticks` of them,
/// but never so far apart that zero stands alone.
double tick_step(double least, double most, int ticks);

/// The forces between which a calibration was made, N: at the ends of its signal's range.
struct ForceRange {
  double least_N = 0, most_N = 0;
};
ForceRange calibrated_range(const ForceCalibration& force);

}  // namespace palpate::viz
