// Settings of a run, each described once: the command line, the window's list of sources and Python take
// names, ranges, units and sentences from here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "capture/live/live_options.h"
#include "capture/run/input.h"
#include "capture/source.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"

namespace palpate {

/// Settings of a run of one input, live or recorded.
struct RunSettings : LoopSettings {
  std::filesystem::path sensor;        ///< sensor file; empty: the input's own
  std::optional<Sensor> given_sensor;  ///< in place of a file
  std::filesystem::path background;    ///< empty: the sensor file's, or the first frames
  std::vector<Output> chosen_outputs;  ///< empty: what the sensor can
  std::optional<SurfaceSolver> solver;
  SolveBy solve_by = SolveBy::Auto;  ///< as in PipelineOptions
  bool fixed_light = false;
  bool one_sequence = false;
  std::vector<std::string> logs;  ///< of other instruments, as LogInput takes them
  bool no_drop = false;           ///< of a recording: frames wait for it
  uint64_t seed = 1;              ///< of simulated scenes that name none
};

struct Setting {
  using Member =
      std::variant<bool RunSettings::*, uint64_t RunSettings::*, double RunSettings::*,
                   std::filesystem::path RunSettings::*, std::vector<Output> RunSettings::*,
                   std::optional<SurfaceSolver> RunSettings::*, std::vector<std::string> RunSettings::*>;
  const char* name;      ///< of Python, with its unit
  const char* option;    ///< of the command line
  const char* sentence;  ///< with its default
  Member member;
  double least = 0, most = std::numeric_limits<double>::infinity();  ///< of a number that is given
  bool least_is_out = false;
  bool may_be_none = false;  ///< Python's None: the default
  const char* example = "";  ///< what to try in place of a value out of range
  const char* unit = "";     ///< of a number; empty: it counts something
};

/// All of them.
std::span<const Setting> run_settings();
/// By its name in Python, which there must be.
const Setting& run_setting(std::string_view name);
bool in_range(const Setting& setting, double value);
/// "above 0", "of at least 1", "from 0.5 to 4", for messages.
std::string range_words(const Setting& setting);

/// The input with its sensor and outputs. Throws Error.
MeasuredInput find_input(const RunSettings& settings);
/// Sets what is left open as the session was recorded.
void as_recorded(RunSettings& settings, const SessionInfo& session);
/// How the frames of `source` are measured; `solver`: where none is chosen. Throws Error(Failure::Usage)
/// where an output is chosen by name that separate pictures cannot have.
PipelineOptions pipeline_options(const RunSettings& settings, Outputs outputs, const Source& source,
                                 SurfaceSolver solver = SurfaceSolver::Live);

}  // namespace palpate
