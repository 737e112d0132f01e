// A recording measured from end to end, with the force gauge's value at each frame.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/files/tables/gauge.h"
#include "capture/run/input.h"
#include "capture/run/run_watch.h"
#include "engine/base/json.h"
#include "engine/calibrate/time_alignment.h"
#include "palpate/touch.h"

namespace palpate {
namespace gpu {
class Context;
}

/// Alignment of the gauge's clock with the recording's.
struct Alignment {
  enum class Kind { Auto, None, Fixed } kind = Kind::Auto;
  double offset_s = 0;  ///< Kind::Fixed: added to the gauge's times
  bool asked = false;   ///< otherwise a table that counts frames is taken as it is
};
/// "auto", "none" or seconds; empty: auto for tables with times. Throws Error(Failure::Usage).
Alignment parse_alignment(const std::string& text);

struct GaugedFrame {
  Touch touch;                             ///< without its lists of contacts and skin points
  double time_s = 0;                       ///< since the recording began; NaN: not known
  double force_N = 0, fx_N = 0, fy_N = 0;  ///< NaN: the gauge does not say
};

struct GaugedRecording {
  std::string input;
  std::string gauge;   ///< its file, or "truth"
  std::string object;  ///< what is pressed; empty: not named
  std::vector<GaugedFrame> frames;
  std::optional<TimeAlignment> alignment;  ///< where the clocks were compared
  std::string clock_signal;                ///< by what of the frames: "sum of gradients", "gray sum", ...
  double offset_s = 0;                     ///< that was added to the gauge's times
  std::vector<std::string> notes;          ///< what to know of it, one line each
  bool separate = false;                   ///< each frame is a press of its own
};

struct GaugeRequest {
  std::string gauge;  ///< CSV file, or "truth" of a synthetic recording
  GaugeColumns columns = GaugeColumns::Normal;
  Alignment alignment;
  double rate_Hz = 0;         ///< of images, which know no times
  bool one_sequence = false;  ///< images without a rate follow each other, as of separate_presses()
  std::string object{};       ///< what is pressed; empty: not named
};

/// Measures every frame (a camera is refused) and reads the gauge at its time: straight between its readings,
/// not across gaps and not beyond its ends. Tables that count frames need no clock. What each of its columns
/// reads while nothing touches is taken off, and a normal force to which a press is negative is turned; the
/// notes say so. Throws Error(Failure::Input) where the two cannot be brought together, and where a column
/// has no steady zero; Error(Failure::Usage) for a pull of frames that do not follow each other.
GaugedRecording measure_with_gauge(gpu::Context& context, const MeasuredInput& input,
                                   const GaugeRequest& request, const RunWatch& watch);

/// "offset 0.1234 s +- 0.0004 s (correlation 0.9991)" and the notes, a line each.
std::string describe(const GaugedRecording& recording);

/// Input, gauge, number of frames, clocks and notes of each.
json::Value to_json(const std::vector<GaugedRecording>& recordings);

/// Origin of a calibration, for its sensor file: recordings, gauges, the time now.
Origin origin_of(const std::vector<GaugedRecording>& recordings, const std::string& note);

}  // namespace palpate
