// Presses of a sample in a recording, with a gauge and a stage where there are any: what its modulus is
// estimated from.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/run/input.h"
#include "capture/run/modulus/modulus_frames.h"
#include "capture/run/run_watch.h"

namespace palpate {

inline constexpr double kStageSd_mm = 0.005;

struct PressRecording {
  MeasuredInput input;
  std::filesystem::path gauge;     ///< table of forces; empty: the image's force
  std::filesystem::path approach;  ///< table of the stage's way; empty: none
  double stage_sd_mm = kStageSd_mm;
  bool one_sequence = false;  ///< as of separate_presses()
};
/// Throws Error(Failure::Sensor) without a scale, and without a force.
void check(const PressRecording& recording);

struct SamplePresses {
  std::vector<PressFrame> frames;  ///< by force, at most 80, evenly over their forces
  std::vector<std::string> notes;  ///< what was passed over, one line each
  bool depth_by_pressure = false;  ///< as in ModulusSetup
};
/// Throws Error(Failure::Input) where no frame can be read.
SamplePresses read_press_frames(gpu::Context& context, const PressRecording& recording, const Sample& sample,
                                const RunWatch& watch);

/// The pad bonded to its base: of this material and thickness (0: not given), else as a sensor says that
/// reads pressure (may be null). Throws Error(Failure::Usage) where neither does.
Pad pad_of(const Material& given, double thickness_mm, const Sensor* sensor);
/// Relative standard error of the sensor's scale; 0: not stated.
double scale_sd(const Sensor& sensor);

}  // namespace palpate
