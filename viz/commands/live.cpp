// palpate live: the surface and the measurements in real time.

#include <optional>
#include <utility>

#include "capture/live/live.h"
#include "capture/live/live_report.h"
#include "capture/open_source.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/camera_options.h"
#include "viz/commands/option_groups/pair_options.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/trace_option.h"
#include "viz/commands/workflow/live_pair.h"
#include "viz/commands/workflow/live_run.h"
#include "viz/render/desktop.h"

namespace palpate {
namespace {

constexpr const char* kDefaultInput = "synthetic:palpation?mode=gel&repeat=0";

struct Options {
  CameraChoice camera;
  PairChoice pair;
  LiveRunRequest request;
  TraceOption trace;
};

Report live_fingers(const Common& common, const Options& options, LivePairRequest request) {
  const LiveRunRequest& one = options.request;
  if (one.block.given()) throw Error(Failure::Usage, "one finger for --block", "two", "without it");
  request.serve = one.serve;
  request.jsonl = common.jsonl;
  request.out = common.out;
  request.record = one.record;
  const std::vector<const char*> extensions = viz::window_extensions();
  const std::unique_ptr<TraceFile> trace = options.trace.start();
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  Remembered remembered;
  request.shown = one.shown;
  request.shown.settings = &remembered.settings;
  request.shown.title = "palpate: two fingers";
  request.recordings = recordings_folder(remembered.settings);
  return live_pair(*context, request);
}

Report live(const Common& common, const Options& options) {
  LiveRunRequest request = options.request;
  request.out = common.out;
  request.seed = common.seed;
  if (request.record && common.out.empty())
    throw Error(Failure::Usage, "--out DIR to record to", "--record alone", "--out out/live");
  if (auto fingers = options.pair.fingers(request, options.camera)) {
    LivePairRequest two;
    two.fingers = std::move(*fingers);
    two.grip = options.pair.grip;
    return live_fingers(common, options, std::move(two));
  }
  if (is_pair_session(request.input)) {
    LivePairRequest two;
    two.fingers = {request, request};
    two.recorded = request.input;
    return live_fingers(common, options, std::move(two));
  }
  request.input = options.camera.input(request.input);
  if (request.input.empty()) request.input = kDefaultInput;
  // Asked before anything else is opened: without a display there is no live view.
  const std::vector<const char*> extensions = viz::window_extensions();
  // Files that are written hold the frames in their order.
  request.replay = common.out.empty() && is_recording(request.input);
  OpenInput opened = open_input(request, interrupted);
  const std::unique_ptr<TraceFile> trace = options.trace.start();
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  Remembered remembered;
  remembered.settings.remember(request.input, request.sensor);
  request.shown.settings = &remembered.settings;
  request.recordings = recordings_folder(remembered.settings);
  request.shown.title = "palpate: " + opened.measured.input;
  if (common.jsonl) request.on_row = print_line;
  const LiveRunReport run = run_live_input(*context, std::move(request), std::move(opened));
  return report_of(run, *context, false, {{"width_px", run.format.width}, {"height_px", run.format.height}});
}

}  // namespace

void add_live(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand("live", "Show surface and measurements live in a window");
  auto options = std::make_shared<Options>();
  LiveRunRequest& request = options->request;
  command->add_option("INPUT", request.input,
                      "Video, folder of images, session of one finger or two, or synthetic:SCENE (default: a "
                      "simulated palpation, without end)");
  options->camera.add_to(*command);
  options->pair.add_to(*command);
  add_settings(
      *command, request,
      {{"sensor",
        "Sensor file (JSON, see engine/sensor/README.md); synthetic inputs and sessions need none, a "
        "camera without one is uncalibrated"},
       {"background"}});
  command->add_option(
      "--out", common.out,
      "Folder for measurements.csv and contacts.csv (frames that were measured), latency.csv, sessions, "
      "snapshots and marks; without it sessions, snapshots and marks go to ~/palpate");
  command->add_flag("--record", request.record,
                    "Write a session from the start; in the window W starts and stops one");
  add_settings(*command, request,
               {{"logs"},
                {"no_drop"},
                {"outputs",
                 "What to measure: force, surface, confidence, contacts, gradient, skin, traction, motion "
                 "(default: what the sensor can, but for motion: where what touches the pad has moved)"},
                {"solver", "Surface solver: live (default) or best; a session's own"},
                {"fixed_light"},
                {"frames"},
                {"seconds"},
                {"rate_Hz", "Frames a second of a recording (default: its own times, 10 for images)"},
                {"sequence"},
                {"patience_s"},
                {"loop"},
                {"close"}});
  command
      ->add_option("--vsync", request.shown.vsync,
                   "on (default), mailbox (newest picture at each refresh), off (at once, may tear)")
      ->transform(one_of(viz::kVsyncNames));
  request.serve.add_to(*command);
  request.block.add_to(*command);
  options->trace.add_to(*command);
  add_common(*command, common,
             "  palpate live                                       a simulated palpation on a gel skin\n"
             "  palpate live --camera /dev/video0 --sensor pad.json --out out/live --record\n"
             "  palpate live press.avi --sensor gel.json --loop    a recording, again and again\n"
             "  palpate live synthetic:slide --seconds 6 --close --out out/live --json\n"
             "  palpate live 'synthetic:tissue?d=12&h=3&ratio=4'   a press of a block with a lump in it\n"
             "  palpate live 'synthetic:object?shape=coin' --outputs force,surface,contacts,motion\n"
             "  palpate live --left synthetic:grip?side=left --right synthetic:grip?side=right\n"
             "In the window: drag to orbit, right-drag to pan, wheel to zoom, W to record, H for all keys.\n"
             "A recording without --out has the keys of replay.\n"
             "Live, the newest frame wins: frames that come too fast are dropped, counted and shown.\n");
  add_jsonl(*command, common);
  command->runs(chosen, [&common, options] { return live(common, *options); });
}

}  // namespace palpate
