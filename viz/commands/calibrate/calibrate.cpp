// palpate calibrate: from known touches to a section of the sensor file.
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/support/options.h"

#include <filesystem>

namespace palpate {

std::string input_exists(const std::string& input) {
  std::error_code error;
  if (input.rfind("synthetic:", 0) == 0 || input.rfind("camera:", 0) == 0 ||
      std::filesystem::exists(input, error))
    return {};
  return "nothing at '" + input + "'";
}

void add_calibrate(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* group = program.add_subcommand("calibrate", "Find a sensor's calibration from known touches");
  group->require_subcommand(1);
  group->footer(
      "Examples:\n"
      "  palpate calibrate scale presses/ --ball-radius-mm 3 --travel-mm 0.25,0.5,0.75,1 --out gel.json\n"
      "  palpate calibrate photometric presses/ --ball-radius-mm 3 --sensor gel.json --out gel.json\n"
      "  palpate calibrate force out/press --gauge gauge.csv --out pad_calibrated.json\n"
      "  palpate help calibrate force\n"
      "Each writes its own section of the sensor file and leaves the others as they are.\n");
  add_calibrate_background(*group, common, chosen);
  add_calibrate_flat(*group, common, chosen);
  add_calibrate_scale(*group, common, chosen);
  add_calibrate_force(*group, common, chosen);
  add_calibrate_shear(*group, common, chosen);
  add_calibrate_photometric(*group, common, chosen);
  add_calibrate_lookup(*group, common, chosen);
  add_calibrate_lights(*group, common, chosen);
}

}  // namespace palpate
