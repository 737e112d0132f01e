// What the person at the window has chosen, and the scales that follow the touch by themselves.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "engine/touch.h"
#include "viz/camera.h"
#include "viz/surface_view.h"

namespace palpate::viz {

enum class Vsync : int { On, Mailbox, Off };  ///< FIFO; newest picture at each refresh; at once (may tear)
const char* to_string(Vsync vsync);
/// As the command line spells them.
inline const std::map<std::string, Vsync> kVsyncNames = {
    {"on", Vsync::On}, {"mailbox", Vsync::Mailbox}, {"off", Vsync::Off}};

/// 1, 2 or 5 times a power of ten, at least `value`: distances of ticks.
double nice_ceiling(double value);
/// A round number of a finer series (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8), at least `value`: ends of scales.
double scale_ceiling(double value);

struct ViewState {
  Camera camera;
  bool automatic_range = true;
  double range_mm = 0.1;  ///< depth with the last colour
  bool automatic_exaggeration = true;
  double exaggeration = 10;
  bool lit = true;
  bool grid = true;
  bool axes = true;
  bool controls = true;
  bool help = false;
  bool paused = false;
  Vsync vsync = Vsync::On;

  // Cleared by whoever takes them.
  bool wants_screenshot = false;
  bool wants_recording_switched = false;
  std::optional<uint64_t> seek_to;  ///< frame of a replay

  /// Follows the touch where automatic: the range grows at once and shrinks only after seconds of lighter
  /// contact, so that colours keep their meaning from frame to frame.
  void follow(const Touch& touch, double longest_side_mm);
  SurfaceStyle style(double longest_side_mm) const;

 private:
  int64_t smaller_since_ns_ = 0;
  bool smaller_ = false;
  double smaller_peak_mm_ = 0;
};

}  // namespace palpate::viz
