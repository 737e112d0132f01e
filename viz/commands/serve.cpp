// palpate serve: touch, depth and pictures live for browsers, Foxglove and other programs, without a window.

#include <spdlog/spdlog.h>

#include "capture/files/measurements.h"
#include "capture/live/live_report.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/camera_options.h"
#include "viz/commands/option_groups/pair_options.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/commands/support/trace_option.h"
#include "viz/commands/workflow/live_run.h"
#include "viz/commands/workflow/serving.h"

namespace palpate {
namespace {

constexpr const char* kDefaultInput = "synthetic:palpation?mode=gel&repeat=0";

struct Options {
  CameraChoice camera;
  PairChoice pair;
  LiveRunRequest request;
  TraceOption trace;
};

Report serve_fingers(const Common& common, const Options& options, std::array<RunSettings, 2> fingers) {
  if (options.request.loop) throw Error(Failure::Usage, "one finger for --loop", "two", "without it");
  PairRequest request = options.pair.request(std::move(fingers), "the run");
  request.out = common.out;
  request.switched = request.paced = true;
  std::optional<Serving> serving;
  request.attach = [&](const PairParts& parts) {
    serving.emplace(options.request.serve.options(), parts, common.out);
    spdlog::info("{}", serving->where());
    if (options.request.record) parts.recording->start();
    if (!common.jsonl) return;
    const auto meter = std::make_shared<PairMeter>(parts.grip);
    parts.options.on_pair = [meter,
                             before = std::move(parts.options.on_pair)](const Matched<FingerTouch>& pair) {
      before(pair);
      print_line(grip_json_line(meter->add(pair)));
    };
  };
  const std::unique_ptr<TraceFile> trace = options.trace.start();
  std::unique_ptr<gpu::Context> context;
  const PairOutcome outcome = record_pair(
      [&]() -> gpu::Context& {
        context = open_device(common);
        return *context;
      },
      request, run_watch(common));
  Facts facts = facts_of(outcome);
  facts.take(serving->finish());
  facts.json["device"] = context->report().name;
  const std::string error = outcome.error();
  if (!error.empty()) spdlog::error("{}", error);
  return {facts.text, facts.json,
          !error.empty()               ? static_cast<int>(Failure::Output)
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

Report serve(const Common& common, const Options& options) {
  LiveRunRequest request = options.request;
  request.window = false;
  request.out = common.out;
  request.seed = common.seed;
  if (request.record && common.out.empty())
    throw Error(Failure::Usage, "--out DIR to record to", "--record alone", "--out out/live");
  if (auto fingers = options.pair.fingers(request, options.camera))
    return serve_fingers(common, options, std::move(*fingers));
  request.input = options.camera.input(request.input);
  if (request.input.empty()) request.input = kDefaultInput;
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
      "start (of two fingers events and sessions alone); without it nothing is written and nobody can start "
      "one");
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
  options->pair.add_to(*command);
  options->trace.add_to(*command);
  add_common(*command, common,
             "  palpate serve                                       a simulated palpation at "
             "http://localhost:8765\n"
             "  palpate serve --camera /dev/video0 --sensor pad.json\n"
             "  palpate serve press.avi --sensor gel.json --loop --port 9000\n"
             "  palpate serve --camera /dev/video0 --sensor pad.json --address 0.0.0.0 --token\n"
             "  palpate serve --camera left=1-2 --camera right=1-3 --grip grip.json --sensor pad.json\n"
             "Ends with Ctrl-C. Open the address that is printed in a browser, or connect Foxglove to it "
             "with ws:// in\n"
             "place of http:// (and --allow-origin for its page). A client that reads too slowly loses "
             "frames, and is\n"
             "told how many; nobody else does. See capture/serve/README.md.\n");
  add_jsonl(*command, common);
  command->runs(chosen, [&common, options] { return serve(common, *options); });
}

}  // namespace palpate
