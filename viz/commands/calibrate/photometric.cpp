// palpate calibrate photometric: from presses of known shapes to a sensor file with its colour calibration.
#include <memory>

#include "capture/calibrate/photometric/shape_text.h"
#include "capture/calibrate/workflow/workflow.h"
#include "viz/commands/calibrate/balls.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_calibrate_photometric(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "photometric", "Colour to slope of a gel sensor, from presses of a known ball or other shape");
  auto options = std::make_shared<PhotometricRequest>();
  add_ball_options(
      *command, *options, common,
      "Presses: a folder of images, a video, a session, synthetic:SCENE?mode=gel; with --balls the "
      "folder or video that it names presses of",
      "pitch, crop, quad, channels");
  command->add_option(
      "--shape", options->shapes,
      std::string("Other shapes than a ball, of INPUT, or RECORDING=SHAPE of a further one: ") +
          kShapeSpellings);
  command
      ->add_option(
          "--model", options->model,
          "Weights by place, to degree 1 to 3, without or with products of colours; best: the simplest that "
          "does as well as any on presses held out")
      ->transform(one_of(kNormalModelNames));
  command
      ->add_option("--rest-weight", options->rest_weight,
                   "Weight of the untouched parts: more where the light drifts, less where it is noisy")
      ->check(Check::range(0.0, 1000.0))
      ->capture_default_str();
  command->add_flag("--keep-contact", options->keep_contact,
                    "Leave the section contact as it is (default: set by what the presses change)");
  command->add_flag("--keep-markers", options->keep_markers, "Use the pixels of printed markers too");
  add_common(
      *command, common,
      "  palpate calibrate photometric presses/ --sensor gel.json --ball-radius-mm 3 \\\n"
      "      --background presses/untouched.png --out gel_calibrated.json\n"
      "  palpate calibrate photometric 'synthetic:palpation?mode=gel' --sensor gel.json \\\n"
      "      --ball-radius-mm 8 --out out.json\n"
      "  palpate calibrate photometric small/ --sensor gel.json --ball-radius-mm 3.155 --balls large=4.75 "
      "\\\n"
      "      --out gel_calibrated.json\n"
      "  palpate calibrate photometric pins/ --sensor gel.json --shape cylinder:diameter=4 \\\n"
      "      --shape tips=cone:half-angle=60:tip-radius=0.3 --out gel_calibrated.json\n"
      "A cylinder lies on the pad, turned by about 90 degrees between presses; a cone stands on its tip.\n"
      "In a table of balls `image` is a file below INPUT, FILE#FRAME for a frame of a video (from 0), or "
      "the frame's\n"
      "number where INPUT is one video; it may have columns shape, axis_deg and length_px too. Errors are of "
      "presses that the fit did not use, left out one "
      "at a time;\n"
      "depth_gain is measured over true depth within the contact, 1 is right. A wrong ball radius or pitch "
      "scales\n"
      "all slopes alike and shows only where a contact would be wider than its ball.\n");
  command->callback([&common, &chosen, options] {
    chosen = [&common, options] {
      take_table(*options);
      return report_of(calibrate_photometric, *options, common);
    };
  });
}

}  // namespace palpate
