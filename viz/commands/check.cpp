// palpate check: whether a sensor file is still true for its gel.
#include <memory>

#include "capture/calibrate/workflow/check.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/calibrate/balls.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

Report check(CheckRequest request, const Common& common) {
  request.out = common.out;
  catch_interrupts();
  std::unique_ptr<gpu::Context> context;
  const auto device = [&]() -> gpu::Context& { return *(context = open_device(common)); };
  const RunWatch watch = run_watch(common);
  const SensorCheck found = check_sensor(request, device, watch);
  if (found.stopped) return interrupted_report();
  const bool clean = !context || validation_clean(*context);
  const int changed = static_cast<int>(Failure::Input);
  return {found.text, found.json, !clean ? kInternalError : found.holds ? 0 : changed};
}

}  // namespace

void add_check(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("check", "Is a sensor file still true for this gel today? One sentence");
  auto options = std::make_shared<CheckRequest>();
  command->add_option("SENSOR", options->sensor, "Sensor file")->required()->check(Check::existing_file());
  command->add_option("RECORDING", options->input, "Recording of today: video, folder of images, session")
      ->required()
      ->check(input_exists);
  command
      ->add_option("--background", options->background,
                   "Picture of the pad at rest today (default: found in RECORDING)")
      ->check(Check::existing_file());
  add_ball_size(*command, options->ball, "ball that is pressed in RECORDING; its depth is then judged too");
  command
      ->add_option("--weight-g", options->weight_g,
                   "What a scale showed at each press of RECORDING, grams; the force is then judged too")
      ->delimiter(',');
  command->add_option("--out", common.out, "Sensor file to write: this one, mended by --weight-g")
      ->option_text("FILE");
  add_common(*command, common,
             "  palpate check gel.json today.avi\n"
             "  palpate check gel.json presses/ --background rest.png --ball-radius-mm 3\n"
             "  palpate check gel.json presses.avi --weight-g 512,830,1204 --out gel.json\n"
             "Compares the untouched picture with that of the calibration (light, pattern, specks, printed "
             "markers), "
             "noise\n"
             "with the threshold, a ball's depth with what is read of it, and weights with forces. Exit code "
             "3 where the calibration is "
             "not true\n"
             "any more, or nothing shows whether it is.\n");
  command->runs(chosen, [&common, options] { return check(*options, common); });
}

}  // namespace palpate
