// palpate setup: from recordings of a sensor of one's own to its sensor file, step by step. Each step is a
// command of its own and can be done again alone.
#include <filesystem>
#include <sstream>
#include <string>

#include "capture/calibrate/photometric/shape_text.h"
#include "engine/base/json.h"
#include "engine/base/shell_word.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/workflow/sensor_setup.h"
#include "viz/commands/workflow/setup_window.h"

namespace palpate {
namespace {

struct Options {
  SetupInputs inputs;
  std::string corners = "none";
  bool window = false;
};

Report report(const SensorSetup& setup, const std::string& recording) {
  Report report;
  json::Value list = json::Value::array();
  for (const SetupStep& step : setup.steps()) {
    const std::string mark = step.done ? "known  " : "MISSING";
    report.text += text("%s  %-16s %s\n", mark.c_str(), step.name.c_str(), step.known.c_str());
    std::istringstream missing(step.missing);
    for (std::string one; std::getline(missing, one);)
      report.text += text("         %-16s -> %s\n", "", one.c_str());
    if (!step.command.empty()) report.text += text("         %-16s    again: %s\n", "", step.command.c_str());
    list.push_back({{"step", step.name},
                    {"known", step.done},
                    {"what", step.known},
                    {"missing", step.missing},
                    {"again", step.command}});
  }
  report.text += "written: " + setup.out().string() + "\ntry it: palpate live " + in_quotes(recording) +
                 " --sensor " + in_quotes(setup.out().string());
  report.json = json::Value{{"sensor", setup.out().string()}, {"steps", list}};
  report.exit_code = interrupted() || setup.interrupted() ? kInterrupted : 0;
  return report;
}

Report setup(const Common& common, const Options& options) {
  SetupInputs inputs = options.inputs;
  if (options.corners == "auto")
    inputs.cut_to_light = true;
  else if (options.corners != "none")
    inputs.corners = parse_corners(options.corners);
  if ((inputs.ball_mm > 0) + (inputs.ball_radius_mm > 0) + (inputs.ball_diameter_mm > 0) > 1)
    throw Error(Failure::Usage, "the ball's size once", "several of them",
                "--ball-radius-mm or --ball-diameter-mm");
  for (const std::string& shape : inputs.shapes) parse_shaped_recording(shape);
  if (options.window) return setup_in_window(common, inputs);
  if (inputs.recording.empty() || common.out.empty())
    throw Error(Failure::Usage, "a recording and --out FILE",
                inputs.recording.empty() ? "no recording" : "no --out",
                "palpate setup press.avi --out pad.json, or palpate setup --window");
  catch_interrupts();
  SensorSetup steps(common.out);
  steps.run_all(inputs);
  return report(steps, inputs.recording);
}

}  // namespace

void add_setup(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "setup", "Make the sensor file of a sensor of your own from recordings, step by step");
  auto o = std::make_shared<Options>();
  SetupInputs& i = o->inputs;
  command
      ->add_option("INPUT", i.recording,
                   "Recording of touches: video, folder of images, session; or camera:NODE")
      ->check(input_exists);
  command->add_option("--like", i.like,
                      "Kind of sensor to start from, its scale, gel and markers: gelsight_mini, "
                      "gelsight_mini_markers, digit, or a file");
  command->add_option("--background", i.background, "Picture of the pad at rest (default: found in INPUT)")
      ->check(Check::existing_file());
  command->add_option(
      "--corners", o->corners,
      "Corners of the pad in the picture, px: top left, top right, bottom right, bottom left as "
      "x,y,x,y,x,y,x,y; auto: those of the light");
  command->add_option("--pitch", i.pitch_mm_per_px, "Scale, mm per px, where it is known")
      ->check(Check::range(1e-6, 100.0));
  command->add_option("--grid-pictures", i.grid_pictures,
                      "Pictures of a grid with known spacing, for the scale");
  command
      ->add_option("--grid-background", i.grid_rest, "Picture of the pad at rest, for a grid that is pressed")
      ->check(Check::existing_file());
  command->add_option("--grid", i.grid, "COLUMNSxROWS of that grid");
  command->add_setting("--pattern", i.pattern, Check::one_of({"chessboard", "dots"}),
                       "What the grid is made of: chessboard or dots");
  command->add_option("--spacing-mm", i.spacing_mm, "Distance from one point of the grid to the next, mm")
      ->check(Check::range(1e-3, 1000.0));
  command->add_option("--ball-radius-mm", i.ball_radius_mm, "Radius of a ball that is pressed, for depth")
      ->check(Check::range(1e-3, 1000.0));
  command->add_option("--ball-diameter-mm", i.ball_diameter_mm, "Or its diameter")
      ->check(Check::range(1e-3, 1000.0));
  command
      ->add_option("--ball-mm", i.ball_mm,
                   "Its radius, by the older name: refused where the pictures show that it is the diameter")
      ->check(Check::range(1e-3, 1000.0));
  command->add_option("--balls", i.balls, "Recording of its presses (default: INPUT)");
  command->add_option("--other-ball", i.other_balls,
                      "RECORDING=RADIUS_MM: presses of another ball, as often as there are");
  command->add_option(
      "--shape", i.shapes,
      std::string("Other shapes than a ball, of the presses, or RECORDING=SHAPE of further ones: ") +
          kShapeSpellings);
  command
      ->add_option("--ball-table", i.ball_table,
                   "Presses of a ball that is not seen whole, by hand: CSV as palpate calibrate photometric "
                   "--balls takes it, of recordings in --balls")
      ->check(Check::existing_file());
  command->add_setting("--surface", i.surface, Check::one_of({"auto", "photometric", "lookup"}),
                       "How depth is read: auto (by what a touch changes), photometric, lookup");
  command
      ->add_option("--gauge", i.gauge,
                   "A force gauge's table of INPUT: CSV with frame or time_s, and force_N")
      ->check(Check::existing_file());
  add_sequence(*command, i.one_sequence);
  command->add_option("--name", i.name, "Name of the sensor (default: the file's)");
  command->add_option("--out", common.out, "Sensor file to write; it is begun anew")
      ->option_text("FILE (required without --window)");
  command->add_flag(
      "--window", o->window,
      "Fill in what is known in a window: the corners are dragged in the picture, and each step can "
      "be done again");
  add_common(
      *command, common,
      "  palpate setup press.avi --out pad.json\n"
      "  palpate setup presses/ --background rest.png --ball-radius-mm 3 --pitch 0.0593 --out gel.json\n"
      "  palpate setup presses/ --like gelsight_mini --ball-diameter-mm 6.31 --out mini.json\n"
      "  palpate setup press.avi --gauge press.csv --corners auto --out pad.json\n"
      "  palpate setup press.avi --window\n"
      "Tells of each step what is known, what is missing and how to get it, and which command does that "
      "step again alone.\n");
  command->runs(chosen, [&common, o] { return setup(common, *o); });
}

}  // namespace palpate
