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
UntouchedImage untouched_image(const std::vector<Frame>& frames, const Sensor& sensor);

/// Up to `wanted` frames of `input`, from the first on, every `every`-th. Any source; `more` (frames so far)
/// may end it by returning false. Frames come as the sensor rectifies them.
std::vector<Frame> take_frames(const std::string& input, const Sensor& sensor, uint32_t wanted,
                               uint32_t every, const std::function<bool(uint64_t)>& more);

/// Puts a copy of the untouched image `given` beside the sensor file `out`, as OUT_background with its own
/// ending, and its name into the sensor; returns the copy's path. Nothing where `given` is empty. Throws
/// Error(Failure::Output), or Error(Failure::Input) where it cannot be read.
std::filesystem::path keep_background(const std::filesystem::path& given, const std::filesystem::path& out,
                                      Sensor& sensor);

/// The sensor that gives frames as the camera does: without crop, lens, quad, flat field and size.
Sensor unrectified(Sensor sensor);

}  // namespace palpate
