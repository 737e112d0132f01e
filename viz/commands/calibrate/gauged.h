// Common parts of the commands that calibrate from recordings with a gauge: force and shear.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/run/input.h"
#include "viz/commands/command.h"

namespace palpate {

class CommandLine;

struct GaugedOptions {
  std::vector<std::string> inputs, gauges;
  std::filesystem::path sensor, background, plots;
  std::string align;
  double rate_Hz = 0;
  bool one_sequence = false;
};

/// RECORDING, --gauge (`table` says what it holds), --sensor, --background, --align, --rate, --sequence,
/// --plots and --out.
void add_gauged_options(CommandLine& command, GaugedOptions& options, Common& common,
                        const std::string& table);

/// One gauge for each recording, "truth" for all of them. Throws Error(Failure::Usage) that names `option`.
std::vector<std::string> paired(const std::vector<std::string>& inputs, std::vector<std::string> gauges,
                                const char* option);

/// As find_input; a sensor without a scale cannot hold a calibration: Error(Failure::Sensor).
MeasuredInput find_scaled_input(const Common& common, const std::string& input, const GaugedOptions& options);

/// Where plots and points lie: in --plots or next to --out, under the sensor file's name and `ending`. Makes
/// the folder.
std::string plot_stem(const Common& common, const GaugedOptions& options, const std::string& ending);

}  // namespace palpate
