#include "viz/commands/calibrate/gauged.h"

#include "capture/files/output_file.h"
#include "palpate/error.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"

namespace palpate {

namespace fs = std::filesystem;

void add_gauged_options(CommandLine& command, GaugedOptions& options, Common& common,
                        const std::string& table) {
  command.add_option("RECORDING", options.inputs, "Sessions, videos, folders of images, synthetic:SCENE")
      ->required();
  command
      .add_option("--gauge", options.gauges,
                  "The gauge's table of each recording: " + table + "; 'truth' of a synthetic one")
      ->required();
  command.add_option("--sensor", options.sensor, "Sensor file to start from (sessions have their own)");
  command
      .add_option("--background", options.background,
                  "Untouched image instead of the sensor file's; kept next to --out")
      ->check(Check::existing_file());
  command.add_option(
      "--align", options.align,
      "The gauge's clock: auto (by cross-correlation), none (it is the recording's), or seconds to "
      "add to it (default: auto, and none for tables that count frames)");
  command
      .add_option("--rate", options.rate_Hz, "Frames a second of images, which carry no times of their own")
      ->check(Check::positive());
  add_sequence(command, options.one_sequence);
  command.add_option("--plots", options.plots, "Folder for plots and points (default: next to --out)");
  command.add_option("--out", common.out, "Sensor file to write")->required()->option_text("FILE (required)");
}

std::vector<std::string> paired(const std::vector<std::string>& inputs, std::vector<std::string> gauges,
                                const char* option) {
  if (gauges.size() == 1 && gauges.front() == "truth") gauges.resize(inputs.size(), "truth");
  if (gauges.size() != inputs.size())
    throw Error(
        Failure::Usage, "one " + std::string(option) + " for each recording, in the same order",
        std::to_string(inputs.size()) + " recordings and " + std::to_string(gauges.size()) + " gauge tables",
        std::string(option) + " once more for each");
  return gauges;
}

MeasuredInput find_scaled_input(const Common& common, const std::string& input,
                                const GaugedOptions& options) {
  MeasuredInput found = find_input(common.seed, input, options.sensor, options.background);
  if (!has_scale(found.sensor))
    throw Error(Failure::Sensor, "a sensor file to put the calibration in", "an uncalibrated camera",
                "--sensor FILE with at least \"pitch_mm_per_px\"");
  return found;
}

std::string plot_stem(const Common& common, const GaugedOptions& options, const std::string& ending) {
  const fs::path folder = options.plots.empty() ? common.out.parent_path() : options.plots;
  if (!folder.empty()) make_output_folder(folder);
  return (folder / common.out.stem()).string() + ending;
}

}  // namespace palpate
