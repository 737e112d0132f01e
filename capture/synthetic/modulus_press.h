// A soft sample under the built-in sensor: the press by finite elements
// (engine/elasticity/modulus/press_truth.h), seen through the simulated waveguide's light, noise and
// rounding, with a stage that is read with an error.
#pragma once

#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/elasticity/modulus/press_truth.h"
#include "palpate/sensor.h"

namespace palpate {

struct SimulatedPresses {
  Sensor sensor;     ///< what is known of the sensor by construction; the pad's modulus with `pad_error`
  Frame background;  ///< untouched
  std::vector<Frame> frames;
  std::vector<TruePress> truth;
  std::vector<double> approach_mm;  ///< as the stage reads it
};

struct ModulusScene {
  Sample sample;
  double young_MPa = 0.103;
  std::vector<double> forces_N = {0.8, 1.0};
  SyntheticOptions sensor;     ///< mode Waveguide; scene and force are not used
  double light = 0;            ///< exposure: touch light over the built-in sensor's; 0: the brightest pixel
                               ///< comes to `brightness` of full scale
  double brightness = 0.4;     ///< less is more noise beside the light of the touch
  double pad_error = 0;        ///< the pad's true modulus over what the sensor file says, less 1
  double stage_sd_mm = 0.005;  ///< of one reading of the stage
  double zero_error_mm = 0;    ///< of the stage's zero
  double size_error = 0;       ///< the sample's true size over the stated one, less 1
};

/// `truth`: made for the sample and the pad of the scene; made here where it is null. Throws
/// Error(Failure::Input) on a mode without pressure, or forces whose contact is wider than the truth's face.
SimulatedPresses simulate_presses(const ModulusScene& scene, const PressTruth* truth = nullptr);

/// A sample as a user would choose it: a cube of 10 mm, a cylinder 10 x 10 mm, a sphere of 16 mm, each known
/// to 0.5 %.
Sample usual_sample(SampleShape shape);
/// Largest force of a press, N, as a user would choose it: 8 % strain, a contact of 0.33 of a ball's radius,
/// or 2 N.
double usual_force_N(const PressModel& model, double young_MPa, double pad_MPa);

/// One frame: light of `press`, `gain` gray per MPa, with its centre at a place in px, noise of frame
/// `sequence`.
Frame render_press(const SyntheticOptions& options, const TruePress& press, double gain, bool square,
                   double x_px, double y_px, uint64_t sequence);

}  // namespace palpate
