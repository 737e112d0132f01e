// palpate serve: touch, depth and pictures live for browsers, Foxglove and other programs, without a window.

#include "capture/live/live_report.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/camera_options.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/trace_option.h"
#include "viz/commands/workflow/live_run.h"

namespace palpate {
namespace {

struct Options {
  CameraChoice camera;
  LiveRunRequest request;
  TraceOption trace;
};

Report serve(const Common& common, const Options& options) {
  LiveRunRequest request = options.request;
  request.window = false;
  request.out = common.out;
  request.seed = common.seed;
  request.input = options.camera.input(request.input);
  if (request.record && common.out.empty())
    throw Error(Failure::Usage, "--out DIR to record to", "--record alone", "--out out/live");
  OpenInput opened = open_input(request, interrupted);
  const std::unique_ptr<TraceFile> trace = options.trace.start();
  const std::unique_ptr<gpu::Context> context = open_device(common);
  if (common.jsonl) request.on_row = print_line;
  const LiveRunReport run = run_live_input(*context, std::move(request), std::move(opened));
  // Who serves until Ctrl-C has done what it was for.
  return report_of(run, *context, true);
}

}  // namespace

void add_serve(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "serve", "Serve touch, depth and pictures live: a page for browsers, and Foxglove's protocol");
  auto options = std::make_shared<Options>();
  LiveRunRequest& request = options->request;
  request.input = "synthetic:palpation?mode=gel&repeat=0";
  command->add_option(
      "INPUT", request.input,
      "Video, folder of images, session, or synthetic:SCENE (default: a simulated palpation, without "
      "end)");
  options->camera.add_to(*command);
  add_settings(*command, request,
               {{"sensor", "Sensor file; a camera without one is uncalibrated"}, {"background"}});
  request.serve.add_to(*command, true);
  command->add_option(
      "--out", common.out,
      "Folder for measurements.csv, contacts.csv, latency.csv, events.csv and the sessions that clients "
      "start; without it nothing is written and nobody can start one");
  command->add_flag("--record", request.record, "Write a session from the start");
  add_settings(*command, request,
               {{"logs"},
                {"no_drop"},
                {"outputs"},
                {"solver", "Surface solver: live (default) or best; a session's own"},
                {"fixed_light"},
                {"frames"},
                {"seconds"},
                {"rate_Hz", "Frames a second of a recording (default: its own times, 10 for images)"},
                {"sequence"},
                {"patience_s"},
                {"loop"}});
  options->trace.add_to(*command);
  add_common(*command, common,
             "  palpate serve                                       a simulated palpation at "
             "http://localhost:8765\n"
             "  palpate serve --camera /dev/video0 --sensor pad.json\n"
             "  palpate serve press.avi --sensor gel.json --loop --port 9000\n"
             "  palpate serve --camera /dev/video0 --sensor pad.json --address 0.0.0.0 --token\n"
             "Ends with Ctrl-C. Open the address that is printed in a browser, or connect Foxglove to it "
             "with ws:// in\n"
             "place of http:// (and --allow-origin for its page). A client that reads too slowly loses "
             "frames, and is\n"
             "told how many; nobody else does. See capture/serve/README.md.\n");
  add_jsonl(*command, common);
  command->runs(chosen, [&common, options] { return serve(common, *options); });
}

}  // namespace palpate
