// The untouched image of a sensor, from frames in which nothing should touch it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

struct UntouchedImage {
  Frame mean;  ///< of the frames that were used, rounded
  size_t used = 0;
  size_t left_out = 0;             ///< frames unlike the others
  double noise_gray = 0;           ///< standard deviation of one pixel of one frame
  double largest_change_gray = 0;  ///< of the filtered change of any used frame from the mean, by the signal
  double threshold_gray = 0;       ///< suggested: half more than that, in steps of 1/128
  double drift_gray = 0;           ///< largest difference of 8 x 8 px means between first and last third
  uint64_t saturated_px = 0;       ///< of the mean
  std::string warning;             ///< what looks like touch or moving light, where, one line; empty: nothing
};

/// Frames of one format, two or more; a frame of which some 8 x 8 px differ from the median frame by more
/// than noise explains is left out. Throws Error(Failure::Input) with fewer, or where more than half are
/// unlike.
/// `chosen`: they are known to be alike, none is left out.
UntouchedImage untouched_image(const std::vector<Frame>& frames, const Sensor& sensor, bool chosen = false);

/// The image of one picture alone: its noise, its drift and a threshold stay unknown (0).
UntouchedImage untouched_picture(const Frame& frame, const Sensor& sensor);

/// Change of a frame from the untouched image, through the sensor's filter and by its signal.
struct ChangeAbove {
  uint64_t pixels = 0;  ///< above the threshold, in any channel
  double upwards = 0;   ///< sum of their change that brightens, gray levels
  double downwards = 0;
  double colour = 0;     ///< of that, how much the channels differ from their mean, gray levels
  double brightest = 0;  ///< largest filtered brightening, whatever the signal; set where pixels > 0
  double darkest = 0;    ///< likewise darkening
};
/// The largest filtered change of a frame, by the sensor's signal, gray levels.
double largest_change(const Frame& frame, const Frame& untouched, const Sensor& sensor);
/// The threshold that a change of so much by noise suggests: half more, in steps of 1/128 gray.
double threshold_over(double noise_change_gray);
ChangeAbove change_above(const Frame& frame, const Frame& untouched, const Sensor& sensor,
                         double threshold_gray);

/// Pixels in which a frame shows a touch whatever its noise and its light: the change, smoothed over 1.5 px
/// and freed of what grows evenly over the picture or with its brightness, passes the threshold and eight
/// times its own scatter.
uint64_t evident_touch_px(const Frame& frame, const Frame& untouched, double threshold_gray);

/// Up to `wanted` frames of `input`, from the first on, every `every`-th. Any source; `more` (frames so far)
/// may end it by returning false. Frames come as the sensor rectifies them.
std::vector<Frame> take_frames(const std::string& input, const Sensor& sensor, uint32_t wanted,
                               uint32_t every, const std::function<bool(uint64_t)>& more);

/// Puts a copy of the untouched image `given` next to the sensor file `out`, as OUT_background with its own
/// ending, and its name into the sensor; returns the copy's path. Nothing where `given` is empty. Throws
/// Error(Failure::Output), or Error(Failure::Input) where it cannot be read.
std::filesystem::path keep_background(const std::filesystem::path& given, const std::filesystem::path& out,
                                      Sensor& sensor);

/// The sensor that gives frames as the camera does: without crop, lens, quad, flat field and size.
Sensor unrectified(Sensor sensor);

}  // namespace palpate
