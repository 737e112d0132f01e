// palpate calibrate: known touches in, a field of the sensor file out.
#include "viz/command_calibrate.h"

#include <CLI/CLI.hpp>

namespace palpate {

void add_calibrate(CLI::App& program, Common& common, Command& chosen) {
  CLI::App* group = program.add_subcommand("calibrate", "Find a sensor's calibration from known touches");
  group->require_subcommand(1);
  add_calibrate_force(*group, common, chosen);
  add_calibrate_shear(*group, common, chosen);
  add_calibrate_photometric(*group, common, chosen);
}

}  // namespace palpate
