// Options of an object that is pressed into the simulated pad and moved.
#pragma once

#include <string>

#include "capture/synthetic/options.h"

namespace palpate {

/// Ranges are checked where it is parsed; a bad value is Error(Failure::Input).
struct ObjectOptions {
  SyntheticOptions camera;         ///< scene "still", mode Gel
  std::string shape = "textured";  ///< one of object_shapes(); not used with a file
  std::string file;                ///< .npy or .stl; empty: the shape
  double pitch_mm = 0.1;           ///< of an .npy file, 0.001 to 10
  std::string path = "slide";      ///< slide, turn, roll, hand, drag, or a .csv file
  double seconds = 10;             ///< of the path between press and lift, 0.1 to 3600; not of a file
  double speed_mm_s = 4;           ///< highest, 0 to 1000
  double reach_mm = 2;             ///< way to each side, 0.01 to 200
  double depth_mm = 0.5;           ///< of the highest point, 0.01 to 5
  double turn_deg = 0;             ///< turns to each side about the pad's normal, 0 to 90
  double tilt_deg = 0;             ///< tilts to each side, 0 to 30
  double tremor_mm = 0.1;          ///< of a hand, 0 to 2
  double x_mm = 0, y_mm = 0;       ///< where the object begins, -200 to 200
  double smooth_mm = 0.12;         ///< standard deviation of the skin's smoothing, 0 to 2
  double creep = 0;                ///< share of the depth that comes and goes late, 0 to 0.9
  double creep_s = 1;              ///< time constant of that, 0.01 to 100

  ObjectOptions() {
    camera.scene = "still";
    camera.mode = SyntheticMode::Gel;
    camera.rate_Hz = 60;
  }
};

/// One line of what happens.
inline constexpr const char* kObjectScene =
    "an object (built in, .npy or .stl) is pressed into a colour gel and moved along a path";

/// True for an input that is such an object: "synthetic:object", alone or followed by "?...".
bool is_object(const std::string& input);
/// "synthetic:object?shape=bead&path=roll&...". Throws Error(Failure::Input) that lists the keys.
ObjectOptions parse_object(const std::string& input);
/// The inverse, with every key that is used.
std::string to_string(const ObjectOptions& options);

}  // namespace palpate
