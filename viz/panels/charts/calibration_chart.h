// The calibrations of force and shear as curves, with the present contacts moving on them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "palpate/sensor.h"
#include "palpate/touch.h"
#include "viz/render/layout.h"

struct ImDrawList;

namespace palpate::viz {

/// A force calibration's curve at one signal.
struct CurvePoint {
  double signal = 0;            ///< in the calibration's unit
  double force_N = 0;           ///< on this branch
  double standard_error_N = 0;  ///< of a single reading there
};

enum class Branch { Loading, Unloading };

/// `count` (2 or more) points of a branch, evenly from `first` to `last`. Without branches both are the
/// curve.
std::vector<CurvePoint> force_curve(const ForceCalibration& calibration, Branch branch, double first,
                                    double last, size_t count);

/// Axis of a calibration's signal: the unit of its numbers and its title with that unit. Gray sums run to
/// thousands of millions: numbers on the axis stay short up to `most`.
struct SignalAxis {
  double unit = 1;
  std::string title;
};
SignalAxis signal_axis(ForceSignal signal, double most);

/// One contact on a calibration's curve.
struct CalibrationMark {
  uint32_t id = 0;    ///< of the contact; 0: the whole touch
  double signal = 0;  ///< force: the calibration's signal; shear: shift, mm
  Estimate force_N;   ///< as measured
};
/// Where the present contacts are: each of several with a signal of its own, else the whole touch, as for a
/// volume or a sum of gradients. Empty where nothing touches.
std::vector<CalibrationMark> force_marks(const ForceCalibration& calibration, const Touch& touch);
/// Shift against tangential force, along x or along y. Shifts by the skin are those of the whole touch.
std::vector<CalibrationMark> shear_marks(const ShearCalibration& calibration, const Touch& touch,
                                         bool along_x);

/// Force over signal: loading solid, unloading dashed, each with a band of two standard errors of a single
/// reading; the calibrated range between dashed limits, beyond them dotted; and the present contacts with
/// their error bars.
void draw_force_calibration(ImDrawList* list, const ViewRect& rect, const ForceCalibration& calibration,
                            const Touch& touch, float scale);

/// Tangential force over shift: K_x solid, K_y dashed, with their bands; the friction limit at the present
/// normal force (without one: at `largest_N`, the largest calibrated) dotted.
void draw_shear_calibration(ImDrawList* list, const ViewRect& rect, const ShearCalibration& calibration,
                            std::optional<double> largest_N, const Touch& touch, float scale);

}  // namespace palpate::viz
