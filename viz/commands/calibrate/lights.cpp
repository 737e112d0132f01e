// palpate calibrate lights: from images of a known shape, each under its own light, to the weights that turn
// such images into slopes.
#include <memory>

#include "capture/calibrate/workflow/workflow.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_calibrate_lights(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "lights", "Photometric stereo with three lights or more, one gray image each, from a known shape");
  auto options = std::make_shared<LightsRequest>();
  command->add_option("IMAGE", options->images, "Gray images of one size, in the order of the lights")
      ->required();
  command
      ->add_option("--height", options->height,
                   "Heights of what the images show, mm: NumPy array, rows x columns (NaN: not known), or a "
                   "scanner's TrueMap file (.tmd)")
      ->required();
  command->add_option("--pitch", options->pitch_mm_per_px, "mm per px")
      ->required()
      ->check(Check::range(1e-6, 100.0));
  command
      ->add_option("--order", options->order,
                   "Of the polynomial by which the light varies over the frame, 0 to 3 (default: 0, 1 or 2, "
                   "as held-out bands say)")
      ->check(Check::range(0, 3));
  command->add_option("--out", common.out, "File to write")->required()->option_text("FILE (required)");
  add_common(*command, common,
             "  palpate calibrate lights image0*.png --height heights.npy --pitch 0.0275 --out lights.json\n"
             "  palpate integrate other0*.png --lights lights.json --out out/height\n"
             "Errors are of heights on pixels that the fit did not use, offset and tilt removed: every other "
             "eighth of the\n"
             "rows (places seen, shapes not), and the upper or the lower half (places not seen either).\n");
  command->callback([&common, &chosen, options] {
    chosen = [&common, options] { return report_of(calibrate_lights, *options, common); };
  });
}

}  // namespace palpate
