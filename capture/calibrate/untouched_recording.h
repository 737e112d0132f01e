// From a whole recording to its untouched image, and what a threshold makes of that recording.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "capture/calibrate/background.h"

namespace palpate {

struct UntouchedRecording {
  uint32_t step = 1;                ///< from one frame that is looked at to the next
  uint64_t looked = 0;              ///< frames
  std::vector<uint64_t> untouched;  ///< numbers of those in which nothing touches, rising
  /// First frames of other kinds of frame that show no touch either, by the frames alone.
  std::vector<uint64_t> rivals;
  UntouchedImage image;  ///< of up to the wanted number of them
  /// With the sensor's signal and `threshold_gray`.
  double threshold_gray = 0;
  uint64_t touched_frames = 0;        ///< looked at, that touch
  uint64_t untouched_that_touch = 0;  ///< of them, taken for untouched: false alarms
  double touched_px = 0;              ///< median area of those that touch
  /// Largest brightening over the sum of largest brightening and darkening, median of touched frames.
  double brighter_peak = 0.5;
  double colour = 0;      ///< of the change in touched frames, how much the colours differ from their mean
  double brighter = 0.5;  ///< fraction of the change in them that is upwards
};

/// Which frames to take for untouched.
struct UntouchedChoice {
  uint32_t frames = 30;               ///< at most so many make the image
  uint32_t every = 0;                 ///< look at every n-th; 0: at as many as FrameKinds takes
  std::optional<uint64_t> like = {};  ///< number of a frame that is known to be untouched
};

/// Finds the untouched frames and makes their image. One frame alone is the image. `more` (frames so far) may
/// end it by returning false: the result then has looked = 0. Throws Error(Failure::Input) where no kind of
/// frame comes often enough, or not the one asked for.
UntouchedRecording find_untouched(const std::string& input, const Sensor& sensor,
                                  const UntouchedChoice& choice, const std::function<bool(uint64_t)>& more);
/// Fills in what `threshold_gray` makes of the recording.
void judge_threshold(const std::string& input, const Sensor& sensor, double threshold_gray,
                     UntouchedRecording& found, const std::function<bool(uint64_t)>& more);
/// Change by the touches of a recording from the sensor's untouched image, by a threshold that a touch
/// surely passes: clear_threshold() of the sensor's, or more where untouched frames change by more. A frame
/// in which no touch is evident above noise and light (evident_touch_px) is untouched.
UntouchedRecording judge_touches(const std::string& input, const Sensor& sensor,
                                 const std::function<bool(uint64_t)>& more);
/// `threshold_gray`, at least a fiftieth of full scale.
double clear_threshold(double threshold_gray, const FrameFormat& format);

/// Which way a touch changes the picture, from what judge_threshold found: the way of
/// its largest change; either way on gels that show slopes by colour.
Signal signal_of(const UntouchedRecording& found);
/// Whether a touch changes the colours apart, as on a gel that shows slopes by colour; else it is a gray
/// one's.
bool shows_slopes_by_colour(const UntouchedRecording& found);

/// "frames 0 to 31, 120 to 160".
std::string frame_ranges(const std::vector<uint64_t>& frames, uint32_t step);

}  // namespace palpate
