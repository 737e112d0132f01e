#include "capture/run/run_settings.h"

#include <array>
#include <stdexcept>

#include "capture/open_source.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using S = RunSettings;

constexpr const char* kSequence =
    "Images without a rate are one sequence, in their order: contacts, shear and light are followed from one "
    "to the next (default: each is a press of its own; --rate says it too)";
constexpr const char* kFixedLight =
    "A colour gel's frames are compared with the untouched image as they are: exposure, white balance and "
    "lamps that change are not followed";

const std::array kSettings = {
    Setting{"sensor", "--sensor", "Sensor file (JSON, see engine/sensor/README.md)", &S::sensor},
    Setting{"background", "--background", "Untouched image (default: the sensor file's, or the first frames)",
            &S::background},
    Setting{"outputs", "--outputs",
            "What to measure: force, surface, confidence, contacts, gradient, skin, traction, motion "
            "(default: what "
            "the sensor can)",
            &S::chosen_outputs},
    Setting{"solver", "--solver", "Surface solver: live or best", &S::solver},
    Setting{"fixed_light", "--fixed-background", kFixedLight, &S::fixed_light},
    Setting{"sequence", "--sequence", kSequence, &S::one_sequence},
    Setting{.name = "rate_Hz",
            .option = "--rate",
            .sentence = "Frames a second of images, which carry no times of their own",
            .member = &S::rate_Hz,
            .least_is_out = true,
            .may_be_none = true,
            .example = "rate_Hz=30",
            .unit = "Hz"},
    Setting{.name = "frames",
            .option = "--frames",
            .sentence = "End after that many frames",
            .member = &S::max_frames,
            .least = 1,
            .may_be_none = true,
            .example = "frames=100"},
    Setting{.name = "seconds",
            .option = "--seconds",
            .sentence = "End after that many seconds",
            .member = &S::max_seconds,
            .least_is_out = true,
            .may_be_none = true,
            .example = "seconds=10",
            .unit = "s"},
    Setting{.name = "patience_s",
            .option = "--patience",
            .sentence = "End with an error where a camera is gone for that long (default: wait)",
            .member = &S::patience_s,
            .example = "patience_s=10, or float('inf')",
            .unit = "s"},
    Setting{.name = "speed",
            .option = "--speed",
            .sentence = "Multiple of the recorded speed",
            .member = &S::speed,
            .least = S::kSlowest,
            .most = S::kFastest,
            .example = "speed=1"},
    Setting{"loop", "--loop", "Start a recording again at its end", &S::loop},
    Setting{"close", "--close", "Close the window at the end of the recording", &S::close_at_end},
    Setting{"logs", "--log",
            "Log of a robot or another instrument that is recorded beside the frames, on their clock: a file "
            "of CSV "
            "or JSON lines, - (standard input) or udp:PORT; NAME=FILE names it",
            &S::logs},
    Setting{"no_drop", "--no-drop",
            "Let frames wait for the recorder instead of dropping them from the recording", &S::no_drop}};

}  // namespace

std::span<const Setting> run_settings() {
  return kSettings;
}

const Setting& run_setting(std::string_view name) {
  for (const Setting& setting : kSettings)
    if (setting.name == name) return setting;
  throw std::logic_error("no setting '" + std::string(name) + "'");
}

bool in_range(const Setting& setting, double value) {
  return (setting.least_is_out ? value > setting.least : value >= setting.least) && value <= setting.most;
}

std::string range_words(const Setting& setting) {
  if (setting.most < std::numeric_limits<double>::infinity())
    return text("from %g to %g", setting.least, setting.most);
  return text(setting.least_is_out ? "above %g" : "of at least %g", setting.least);
}

MeasuredInput find_input(const RunSettings& settings) {
  MeasuredInput found =
      settings.given_sensor
          ? find_input(settings.seed, settings.input, settings.given_sensor, settings.background)
          : find_input(settings.seed, settings.input, settings.sensor, settings.background);
  if (!settings.chosen_outputs.empty()) found.outputs = outputs_of(settings.chosen_outputs);
  return found;
}

void as_recorded(RunSettings& settings, const SessionInfo& session) {
  if (!settings.solver) {
    settings.solver = session.solver;
    settings.solve_by = session.solve_by;
  }
  settings.fixed_light = settings.fixed_light || session.fixed_light;
}

PipelineOptions pipeline_options(const RunSettings& settings, Outputs outputs, const Source& source,
                                 SurfaceSolver solver) {
  const bool separate = separate_presses(source, settings.one_sequence, settings.rate_Hz);
  if (separate && wants(outputs_of(settings.chosen_outputs), Output::Skin))
    throw Error(Failure::Usage, "frames that follow each other, for the output skin",
                "'" + settings.input + "': pictures without a rate, each of them a press of its own",
                "--sequence where they do, or other outputs");
  return {.outputs = outputs,
          .solver = settings.solver.value_or(solver),
          .fixed_light = settings.fixed_light,
          .separate = separate,
          .solve_by = settings.solve_by};
}

}  // namespace palpate
