// A contact's signal to newtons, with its standard error from the calibration.
#pragma once

#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {

/// Input of a normal force: one contact in one frame.
struct ForceFeatures {
  double gray_sum = 0;    ///< gray levels
  double area_px = 0;     ///< of the contact
  double volume_mm3 = 0;  ///< indented; only with has_volume
  bool has_volume = false;
  bool contact = false;
  /// Most that the contact's saturated pixels may hide, as a fraction of the gray sum (each as much again as
  /// the brightest pixel shows) and of a gradient sum or volume (each what 9 pixels show on average).
  double hidden_gray = 0;
  double hidden_slopes = 0;
  bool at_border = false;   ///< the contact reaches the frame's border
  double gradient_sum = 0;  ///< gray levels times px; only with has_gradient
  bool has_gradient = false;
  double layer_N = 0;  ///< by the elastic layer, with its own standard error; only with has_layer
  double layer_sd_N = 0;
  bool has_layer = false;
  Validity layer_validity = Validity::NotCalibrated;
  double bending_mm = 0;  ///< only with has_bending
  bool has_bending = false;
};

/// The reading of a frame's whole touch, and of one of several contacts (which has neither volume nor
/// gradient sum of its own).
ForceFeatures force_features(const Touch& touch);
ForceFeatures force_features(const ContactTouch& contact);

/// The reading of a contact inside the frame whose signal is `signal`.
ForceFeatures reading_at(const ForceCalibration& calibration, double signal);

/// Whether a reading has what a signal needs.
bool has_signal(ForceSignal signal, const ForceFeatures& features);
/// The calibration's signal, in its unit.
double signal_of(const ForceCalibration& calibration, const ForceFeatures& features);

/// Part of a reading's scatter that grows with the force, N.
double growing_scatter_N(const ForceCalibration& calibration, double force_N);

/// Force at a signal, N: both directions together, and by one direction's curve. A spline ends level: beyond
/// its knots it stays at the last one's force.
double force_at(const ForceCalibration& calibration, double signal);
double force_at(ForceModel model, const ForceCurve& curve, double signal);

/// Fraction of the calibrated range by which the signal has to reverse before the contact changes to the
/// other branch.
inline constexpr double kTurn_fraction = 0.05;

/// Which branch a contact is on: 0 loading, 1 unloading, between them just after a reversal. A play of width
/// kTurn_fraction of the calibrated range: noise that is smaller does not make it flicker.
class LoadDirection {
 public:
  /// The next contact began unseen: its branch is not known until it has moved.
  void interrupt();
  /// One frame of one contact, in order; `width`: of the play, in the signal's unit. Returns unloading().
  double update(bool contact, double signal, double width);
  double unloading() const { return unloading_; }

 private:
  bool in_contact_ = false;
  bool interrupted_ = false;
  double last_ = 0;
  double unloading_ = 0;
};

/// Normal force of one reading, standard error of a single prediction. `unloading`: as LoadDirection says;
/// without branches in the calibration it does not matter. Between the branches the value lies between
/// theirs, and its error grows by their mixture's, sqrt(w (1 - w)) of the gap. The mean of two readings is
/// known no better than to half of what they differ by. States, the first that holds:
/// no contact (force 0), not calibrated (what the signal needs
/// is not there), a calibration not fit for use, saturated (pixels at the camera's limit
/// may hide more than the interval of 95 % holds; otherwise it is wider by what they hide), at the border,
/// above or below the calibrated range, calibrated on too few objects.
Estimate force_of(const ForceCalibration& calibration, const ForceFeatures& features, double unloading = 0.5);

/// Follows one contact from its onset and computes its force in each frame.
class ForceHistory {
 public:
  /// The next frame does not continue the last one.
  void interrupt() { direction_.interrupt(); }
  Estimate update(const ForceCalibration& calibration, const ForceFeatures& features);
  double unloading() const { return direction_.unloading(); }

 private:
  LoadDirection direction_;
};

/// force_of for a calibration of the gray sum, of a reading that is all inside the frame (Eq. 54).
Estimate force_from_gray(const ForceCalibration& calibration, double gray_sum, bool contact,
                         double hidden_gray = 0);

}  // namespace palpate
