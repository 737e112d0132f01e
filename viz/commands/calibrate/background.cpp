// palpate calibrate background: from untouched frames to the background image and its noise.
#include <memory>

#include "capture/calibrate/workflow/workflow.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_calibrate_background(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "background", "The untouched image, its noise, and a contact threshold that fits it");
  auto options = std::make_shared<BackgroundRequest>();
  command
      ->add_option("INPUT", options->input,
                   "Frames as the camera gives them: a recording that shows the pad at rest somewhere, one "
                   "untouched picture, or camera:NODE while nothing touches")
      ->required()
      ->check(input_exists);
  command->add_option("--sensor", options->sensor,
                      "Sensor file to start from (default: what the frames say)");
  command->add_option("--frames", options->frames, "Number of untouched frames to average")
      ->check(Check::range(2, 1000))
      ->capture_default_str();
  command->add_option("--every", options->every, "Look at every n-th frame (default: at 400)")
      ->check(Check::range(1, 10000));
  command->add_option("--like", options->like,
                      "Number of a frame in which nothing touches; frames like it count as untouched");
  command->add_flag("--set-threshold", options->set_threshold,
                    "Also set contact.threshold_gray as suggested (without a sensor file it is)");
  command->add_option("--out", common.out, "Sensor file to write; the image goes next to it")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate calibrate background camera:/dev/video0 --sensor pad.json --out pad.json\n"
      "  palpate calibrate background press.avi --out pad.json\n"
      "  palpate calibrate background rest.png --sensor pad.json --out pad.json\n"
      "Frames that are alike belong together; the evenest kind that comes often is the untouched one (by "
      "the signal: the darkest, or the brightest). A warning says where something moves.\n");
  command->callback([&common, &chosen, options] {
    chosen = [&common, options] { return report_of(calibrate_background, *options, common); };
  });
}

}  // namespace palpate
