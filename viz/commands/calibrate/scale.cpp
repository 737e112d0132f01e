// palpate calibrate scale: from an object of known size to mm per pixel and the lens's distortion.
#include <map>
#include <memory>

#include "capture/calibrate/workflow/workflow.h"
#include "viz/commands/calibrate/balls.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_calibrate_scale(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("scale", "mm per pixel and lens distortion, from a grid, a ring or a ball");
  auto options = std::make_shared<ScaleRequest>();
  command->add_option("INPUT", options->input, "Pictures: an image, a folder of images, a video")
      ->required()
      ->check(input_exists);
  command->add_option("--sensor", options->sensor,
                      "Sensor file to start from (default: only what the pictures say)");
  command->add_option("--grid", options->grid, "COLUMNSxROWS of a printed grid: inner corners, or dots");
  command->add_option("--pattern", options->pattern, "What the grid is made of: chessboard or dots")
      ->transform(one_of(std::map<std::string, GridPattern>{{"chessboard", GridPattern::Chessboard},
                                                            {"dots", GridPattern::Dots}}));
  command
      ->add_option("--spacing-mm", options->spacing_mm, "Distance from one point of the grid to the next, mm")
      ->check(Check::range(1e-3, 1000.0));
  command
      ->add_option("--spacing-sd", options->spacing_sd,
                   "Relative standard error of the spacing (default: a good printer's)")
      ->check(Check::range(0.0, 0.5))
      ->capture_default_str();
  command->add_option("--ring-mm", options->ring_mm, "Outer diameter of a ring or disc pressed into the pad")
      ->check(Check::range(1e-3, 1000.0));
  add_ball_size(*command, options->ball, "ball that is pressed several times");
  command
      ->add_option("--travel-mm", options->travel_mm,
                   "Depth of the ball in each picture in which it is pressed, mm, in order, from any zero")
      ->delimiter(',');
  command
      ->add_option("--background", options->background,
                   "Untouched image; a grid is then looked for in the change")
      ->check(Check::existing_file());
  command->add_option("--out", common.out, "Sensor file to write")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate calibrate scale grid/ --grid 9x6 --spacing-mm 2 --sensor pad.json --out pad.json\n"
      "  palpate calibrate scale pegs.png --background rest.png --grid 9x7 --pattern dots \\\n"
      "      --spacing-mm 2.5 --sensor pad.json --out pad.json\n"
      "  palpate calibrate scale presses/ --ball-radius-mm 3 --travel-mm 0.25,0.5,0.75,1 \\\n"
      "      --background rest.png --sensor gel.json --out gel.json\n"
      "A grid also sets lens, quad_px and size_px: the frame becomes what the first picture shows whole. A "
      "ball alone\n"
      "does not determine the scale; with its travel it does to about 13 %, since the pad's sinking around "
      "it "
      "is not known.\n");
  command->callback([&common, &chosen, options] {
    chosen = [&common, options] { return report_of(calibrate_scale, *options, common); };
  });
}

}  // namespace palpate
