// palpate compare: two recordings side by side on one time, and by how much they differ.
#include <memory>
#include <string>
#include <utility>

#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "capture/run/compare/compare_recordings.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/commands/workflow/live_run.h"
#include "viz/display/compare_window.h"
#include "viz/render/desktop.h"

namespace palpate {
namespace {

struct Options {
  RunSettings settings;
  std::string a, b;
  std::filesystem::path sensor_b;
  Alignment alignment = Alignment::Touch;
  std::string mark;
  double offset_s = 0;
};

RecordingCurve curve_of(gpu::Context& context, const Options& options, bool second, const Common& common,
                        const viz::Settings& remembered) {
  LiveRunRequest request;
  static_cast<RunSettings&>(request) = options.settings;
  request.input = second ? options.b : options.a;
  request.seed = common.seed;
  if (second && !options.sensor_b.empty()) request.sensor = options.sensor_b;
  request.replay = is_recording(request.input);
  request.recordings = recordings_folder(remembered);
  return measure_curve(context, request, known_events(request), run_watch(common));
}

Report compare(const Common& common, const Options& options) {
  const bool headless = !common.out.empty();
  std::vector<const char*> extensions;
  if (!headless) extensions = viz::window_extensions();
  const std::unique_ptr<gpu::Context> context = open_device(common, headless ? nullptr : &extensions);
  Remembered remembered;
  const RecordingCurve a = curve_of(*context, options, false, common, remembered.settings);
  const RecordingCurve b = curve_of(*context, options, true, common, remembered.settings);
  const SharedTime time(a, b, options.alignment, options.mark, options.offset_s);
  viz::CompareState state{.alignment = options.alignment,
                          .mark = options.mark,
                          .offset_s = options.offset_s,
                          .light = remembered.settings.view.light_theme,
                          .map = remembered.settings.view.map};
  const Facts facts = facts_of(a, b, compare_largest(a, b), options.alignment, time);
  std::string text = facts.text;
  if (headless) {
    viz::write_comparison(common.out, viz::compare_picture(*context, a, b, state, {1280, 720}), a, b);
    text += "\nwritten: " + (common.out / "comparison.png").string() + ", comparison.csv\n";
  } else {
    const std::filesystem::path folder = recordings_folder(remembered.settings);
    viz::run_compare_window(*context, a, b, state, remembered.settings,
                            folder.empty() ? folder : folder / "comparison", interrupted);
  }
  return {text, facts.json, interrupted() ? kInterrupted : validation_clean(*context) ? 0 : kInternalError};
}

}  // namespace

void add_compare(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "compare", "Two recordings side by side on one time: force, depth and area, and how they differ");
  auto options = std::make_shared<Options>();
  command->add_option("A", options->a, "Session, video, folder of images with --rate, or synthetic:SCENE")
      ->required();
  command->add_option("B", options->b, "The other one")->required();
  add_settings(*command, options->settings, {{"sensor", "Sensor file of both; sessions have their own"}});
  command->add_option("--sensor-b", options->sensor_b, "Sensor file of B, where it is another one")
      ->takes_path();
  command
      ->add_option(
          "--align-by", options->alignment,
          "What both have at time 0: touch (first touch, default), start (first frame), largest (largest "
          "force) or mark")
      ->transform(one_of(kAlignmentNames));
  command->add_option("--mark", options->mark, "Text of the mark to align by (default: the first mark)");
  command->add_option("--offset", options->offset_s, "Seconds by which B is moved to later times");
  command->add_option("--out", common.out,
                      "Folder for comparison.png and comparison.csv; no window is opened then");
  add_settings(*command, options->settings,
               {{"solver", "Surface solver: best (default) or live; a session's own"},
                {"rate_Hz", "Frames a second of images"},
                {"frames", "Measure no more than that many frames of each"}});
  add_common(
      *command, common,
      "  palpate compare out/press1 out/press2\n"
      "  palpate compare monday.avi tuesday.avi --sensor gel.json --align-by largest\n"
      "  palpate compare out/soft out/hard --align-by mark --mark pressed --out out/compared\n"
      "In the window: Space plays, a click in the charts goes there, A aligns anew, [ and ] move B, S saves\n"
      "picture and table, H shows all keys. Errors of the two are taken as independent, so that a "
      "difference\n"
      "between recordings of one calibration is known at least as well as is said.\n");
  command->runs(chosen, [&common, options] { return compare(common, *options); });
}

}  // namespace palpate
