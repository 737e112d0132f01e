// palpate calibrate flat: from frames that should look even to the flat field that corrects the light.
#include <memory>

#include "capture/calibrate/workflow/workflow.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_calibrate_flat(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("flat", "Correct uneven light by a field that every frame is multiplied by");
  auto options = std::make_shared<FlatRequest>();
  command
      ->add_option(
          "INPUT", options->input,
          "Frames of what should look even: the untouched pad of a gel, a flat target pressed all over")
      ->required()
      ->check(input_exists);
  command->add_option("--sensor", options->sensor, "Sensor file to start from")->required();
  command->add_option("--frames", options->frames, "How many frames")
      ->check(Check::range(2, 1000))
      ->capture_default_str();
  command->add_option("--every", options->every, "Take every n-th frame")->check(Check::range(1, 10000));
  command->add_flag(
      "--change", options->change,
      "Even out the change from the untouched image: a waveguide, whose light shows where it is pressed");
  command->add_option("--out", common.out, "Sensor file to write; the field's image goes next to it")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate calibrate flat untouched.avi --sensor gel.json --out gel.json\n"
      "  palpate calibrate flat pressed_flat.avi --change --sensor pad.json --out pad.json\n"
      "One factor for all channels: brightness is evened, colour stays. The untouched image is treated "
      "alike;\n"
      "saturated pixels stay saturated.\n");
  command->callback([&common, &chosen, options] {
    chosen = [&common, options] { return report_of(calibrate_flat, *options, common); };
  });
}

}  // namespace palpate
