// palpate live: the surface and the measurements in real time.
#include <spdlog/spdlog.h>

#include <optional>
#include <tuple>
#include <utility>

#include "capture/live/live.h"
#include "capture/live/live_report.h"
#include "capture/open_source.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/camera_options.h"
#include "viz/commands/option_groups/sequence_option.h"
#include "viz/commands/support/live_run.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/render/desktop.h"

namespace palpate {
namespace {

struct Options {
  std::string input = "synthetic:palpation?mode=gel&repeat=0";
  CameraChoice camera;
  std::filesystem::path sensor;
  std::filesystem::path background;
  std::optional<SurfaceSolver> solver;
  bool skip_untouched = false;
  bool fixed_light = false;
  bool one_sequence = false;
  bool record = false;
  SessionOptions session;
  BlockChoice block;
  LiveOptions live;
  viz::WindowRun shown;
};

Report live(const Common& common, const Options& options) {
  if (options.record && common.out.empty())
    throw Error(Failure::Usage, "--out DIR to record to", "--record alone", "--out out/live");
  // Asked before anything else is opened: without a display there is no live view.
  const std::vector<const char*> extensions = viz::window_extensions();
  LiveRunRequest request{.input = options.camera.input(options.input),
                         .sensor = options.sensor,
                         .background = options.background,
                         .solver = options.solver,
                         .skip_untouched = options.skip_untouched,
                         .fixed_light = options.fixed_light,
                         .one_sequence = options.one_sequence,
                         .out = common.out,
                         .recordings = {},
                         .notes = {},
                         .on_row = {},
                         .record = options.record,
                         .session = options.session,
                         .block = options.block,
                         .live = options.live,
                         .shown = options.shown};
  OpenInput opened = open_input(common, request, interrupted);
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  Remembered remembered;
  remembered.settings.remember(request.input, request.sensor);
  request.shown.settings = &remembered.settings;
  request.recordings = recordings_folder(remembered.settings);
  // What is written holds the frames in their order.
  request.live.replay = common.out.empty() && is_recording(request.input);
  request.shown.title = "palpate: " + opened.measured.input;
  request.live.interrupted = interrupted;
  if (common.jsonl) request.on_row = print_line;
  const LiveRunReport run = run_live_input(*context, std::move(request), std::move(opened));
  const MeasuredInput& input = run.measured;
  const auto& [report, sessions] = std::tie(run.live, run.sessions);
  if (const std::string error = recording_error(sessions); !error.empty()) spdlog::error("{}", error);

  json::Value value = {{"input", input.input},
                       {"sensor", input.sensor.name},
                       {"device", context->report().name},
                       {"width_px", run.format.width},
                       {"height_px", run.format.height}};
  value.update(to_json(report, sessions));
  return {describe(report, sessions), value.dump(2, json::Utf8::Replace),
          report.interrupted                   ? kInterrupted
          : !recording_error(sessions).empty() ? static_cast<int>(Failure::Output)
          : validation_clean(*context)         ? 0
                                               : kInternalError};
}

}  // namespace

void add_live(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand("live", "Show surface and measurements live in a window");
  auto options = std::make_shared<Options>();
  LiveOptions& live_options = options->live;
  command->add_option("INPUT", options->input,
                      "Video, folder of images, session, or synthetic:SCENE (default: a simulated "
                      "palpation, without end)");
  options->camera.add_to(*command);
  command->add_option(
      "--sensor", options->sensor,
      "Sensor file (JSON, see engine/sensor/README.md); synthetic inputs and sessions need none, a camera "
      "without one is uncalibrated");
  command
      ->add_option("--background", options->background,
                   "Untouched image (default: the sensor file's, or the first frames)")
      ->check(Check::existing_file());
  command->add_option(
      "--out", common.out,
      "Folder for measurements.csv and contacts.csv (frames that were measured), latency.csv, sessions, "
      "snapshots and marks; without it sessions, snapshots and marks go to ~/palpate");
  command->add_flag("--record", options->record,
                    "Write a session from the start; in the window W starts and stops one");
  command->add_flag("--no-drop", options->session.no_drop,
                    "Let frames wait for the recorder instead of dropping them from the recording");
  command
      ->add_option("--solver", options->solver,
                   "Surface solver: live (default), fine, converged, exact (CPU) or auto; a session's own")
      ->transform(one_of(kSolverNames));
  command->add_flag("--skip-untouched", options->skip_untouched,
                    "Compute only a window around the contact; beyond it depth is 0");
  command->add_flag(
      "--fixed-background", options->fixed_light,
      "A colour gel's frames are compared with the untouched image as they are: exposure, white "
      "balance and lamps that change are not followed");
  command->add_option("--frames", live_options.max_frames, "End after that many frames");
  command->add_option("--seconds", live_options.max_seconds, "End after that many seconds")
      ->check(Check::positive());
  command
      ->add_option("--rate", live_options.rate_Hz,
                   "Frames a second of a recording (default: its own times, 10 for images)")
      ->check(Check::positive());
  add_sequence(*command, options->one_sequence);
  command->add_flag("--loop", live_options.loop, "Start a recording again at its end");
  command->add_flag("--close", live_options.close_at_end, "Close the window at the end of the recording");
  command
      ->add_option("--vsync", options->shown.vsync,
                   "on (default), mailbox (newest picture at each refresh), off (at once, may tear)")
      ->transform(one_of(viz::kVsyncNames));
  options->block.add_to(*command);
  add_common(*command, common,
             "  palpate live                                       a simulated palpation on a gel skin\n"
             "  palpate live --camera /dev/video0 --sensor pad.json --out out/live --record\n"
             "  palpate live press.avi --sensor gel.json --loop    a recording, again and again\n"
             "  palpate live synthetic:slide --seconds 6 --close --out out/live --json\n"
             "  palpate live 'synthetic:tissue?d=12&h=3&ratio=4'   a press of a block with a lump in it\n"
             "In the window: drag to orbit, right-drag to pan, wheel to zoom, W to record, H for all keys.\n"
             "A recording without --out has the keys of replay.\n"
             "Live, the newest frame wins: frames that come too fast are dropped, counted and shown.\n");
  add_jsonl(*command, common);
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return live(common, *options); }; });
}

}  // namespace palpate
