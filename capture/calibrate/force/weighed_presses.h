// Presses on a scale: force of each as the sensor reads it, against the weight that the scale showed.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "capture/run/run_watch.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {
namespace gpu {
class Context;
}

struct WeighedPress {
  double weight_N = 0;
  double force_N = 0;  ///< by the sensor
  double own_sd_N =
      0;  ///< of this press and its object alone, > 0: without the modulus' error, which all share
  double stated_sd_N = 0;  ///< with it
  bool at_border = false;
};

/// One factor on the forces that a calibration gives.
struct WeighedGain {
  double gain = 1;    ///< weight over force, by the presses alone
  double sd = 0;      ///< its standard error
  double stated = 0;  ///< relative standard error that the calibration states of these forces
  double limit = 1;   ///< the calibration is true where `gain` is within this factor of 1, either way
  /// false: presses differ by more than their errors, so that no factor mends them; `mended` is 1.
  bool agree = true;
  double least = 1, most = 1;  ///< weight over force of single presses
  /// With the calibration's own evidence, by both errors; without where three presses or more contradict it.
  double mended = 1;
  double mended_sd = 0;
};

/// The median of weight over force. Its error is the larger of what the presses state and
/// what they scatter, and holds for other objects: each has a gain of its own.
WeighedGain weigh(std::span<const WeighedPress> presses);

/// Every press of `input` in order, held against `weight_g`, grams, one a press: the largest mean over half a
/// second, which is what a scale shows, of separate pictures each picture's. Throws Error(Failure::Input)
/// where there are more or fewer presses, or one whose force is not known, and Error(Failure::Sensor) without
/// a calibration of force or a layer.
std::vector<WeighedPress> weighed_presses(gpu::Context& context, const Sensor& sensor,
                                          const std::string& input, std::span<const double> weight_g,
                                          const RunWatch& watch);

/// The mended calibration: of the curves of the force section and, where these are of the layer's
/// force or there are none, of the layer's modulus.
void set_gain(Sensor& sensor, const WeighedGain& gain, const std::string& input);

}  // namespace palpate
