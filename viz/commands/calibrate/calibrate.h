// The commands below palpate calibrate, each in a file of its own.
#pragma once

#include <string>

#include "capture/calibrate/workflow/workflow.h"
#include "viz/commands/command.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"

namespace palpate {

class CommandLine;

/// For CLI's `check`: an input that is neither a camera nor synthetic has to exist. Empty: it does.
std::string input_exists(const std::string& input);

/// Runs a calibration into --out, with a progress bar; Ctrl-C ends it.
template <typename Request>
Report report_of(CalibrationReport (*calibrate)(const Request&, const CalibrationRun&),
                 const Request& request, const Common& common) {
  catch_interrupts();
  const RunWatch watch = run_watch(common);
  const CalibrationReport report = calibrate(request, {common.out, watch});
  if (report.stopped) return interrupted_report();
  return {report.text, report.json};
}

/// Each adds one command to the group `calibrate`.
void add_calibrate_background(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_flat(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_scale(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_force(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_shear(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_photometric(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_lookup(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_lights(CommandLine& group, Common& common, Command& chosen);

}  // namespace palpate
