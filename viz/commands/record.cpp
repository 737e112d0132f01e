// palpate record: frames and measurements into a session folder, without a window.
#include <spdlog/spdlog.h>

#include "capture/files/event_log.h"
#include "capture/live/live_report.h"
#include "capture/run/input.h"
#include "capture/run/record_session.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/block_options.h"
#include "viz/commands/option_groups/camera_options.h"
#include "viz/commands/option_groups/pair_options.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/option_groups/serve_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/run_watch.h"
#include "viz/commands/support/trace_option.h"
#include "viz/commands/workflow/serving.h"

namespace palpate {
namespace {

struct Options {
  CameraChoice camera;
  PairChoice pair;
  RecordRequest request;
  BlockChoice block;
  ServeChoice serve;
  TraceOption trace;
};

Report record_fingers(const Common& common, const Options& options, std::array<RunSettings, 2> fingers) {
  PairRequest request = options.pair.request(std::move(fingers), "the recording");
  request.out = common.out;
  std::optional<Serving> serving;
  if (options.serve.on)
    request.attach = [&](const PairParts& parts) {
      serving.emplace(options.serve.options(), parts, common.out);
      spdlog::info("{}", serving->where());
    };
  std::unique_ptr<gpu::Context> context;
  const PairOutcome outcome = record_pair(
      [&]() -> gpu::Context& {
        context = open_device(common);
        return *context;
      },
      request, run_watch(common));
  const std::string error = outcome.error();
  if (!error.empty()) spdlog::error("the recording ended early: {}", error);
  Facts facts = facts_of(outcome);
  if (serving) facts.take(serving->finish());
  facts.json["device"] = context->report().name;
  facts.json["complete"] = !outcome.run.interrupted && error.empty();
  return {facts.text, facts.json,
          !error.empty()               ? static_cast<int>(Failure::Output)
          : outcome.run.interrupted    ? kInterrupted
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

Report record(const Common& common, const Options& options) {
  RecordRequest request = options.request;
  request.seed = common.seed;
  if (auto fingers = options.pair.fingers(request, options.camera)) {
    if (request.mcap || options.block.given())
      throw Error(Failure::Usage, "one finger for --mcap and --block", "two",
                  "without them, or palpate export of each finger's session");
    return record_fingers(common, options, std::move(*fingers));
  }
  request.folder = common.out;
  request.input = options.camera.input(request.input);
  if (request.input.empty())
    throw Error(Failure::Usage, "INPUT or --camera NODE", "neither", "palpate cameras, which lists them");
  const MeasuredInput input = request.found = find_input(request);
  request.on_device_lost = [](const DeviceLost& lost) {
    spdlog::warn("{}; opened anew, the recording goes on", lost.what());
  };
  request.watch = [&](const Frame& background) { return monitor_presses(options.block, input, background); };
  std::optional<Serving> serving;
  if (options.serve.on)
    request.attach = [&](LiveOptions& live, Recording& recording, const PipelineOptions& pipeline) {
      const MeasuredColumns columns = MeasuredColumns::of(input.sensor, pipeline.outputs, pipeline.separate);
      serving.emplace(options.serve.options(),
                      LiveHub::Publisher{input.sensor, pipeline.outputs, columns, {}}, common.out);
      serving->attach(live, &recording);
      spdlog::info("{}", serving->where());
    };
  const std::unique_ptr<TraceFile> trace = options.trace.start();
  std::unique_ptr<gpu::Context> context;
  const auto device = [&]() -> gpu::Context& {
    context = open_device(common);
    return *context;
  };
  const auto [report, session, mcap] = record_session(device, request, run_watch(common));
  for (const PressAnswer& press : report.presses)
    viz::append_event(common.out, {press.last_frame, press.time_s, "lump", describe(press)});
  const std::string& error = session.status.error.empty() && mcap ? mcap->error : session.status.error;
  if (!error.empty()) spdlog::error("the recording ended early: {}", error);

  json::Value value = {
      {"input", input.input}, {"sensor", input.sensor.name}, {"device", context->report().name}};
  Facts facts = facts_of(report, {session});
  if (serving) {
    facts.take(serving->finish());
  }
  if (mcap)
    facts.add("mcap", {{"written", mcap->written}, {"dropped", mcap->dropped}, {"bytes", mcap->bytes}},
              "recording.mcap: " + std::to_string(mcap->written) + " frames, " +
                  std::to_string(mcap->dropped) + " dropped\n");
  value.update(facts.json);
  value["complete"] = !report.interrupted && error.empty();
  return {facts.text, value,
          !error.empty()               ? static_cast<int>(Failure::Output)
          : report.interrupted         ? kInterrupted
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

}  // namespace

void add_record(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("record", "Write a session: lossless frames and their measurements");
  auto options = std::make_shared<Options>();
  RecordRequest& request = options->request;
  command->add_option("INPUT", request.input, "Video, folder of images, session, or synthetic:SCENE");
  options->camera.add_to(*command);
  add_settings(
      *command, request,
      {{"sensor", "Sensor file; a camera without one is recorded as it is, uncalibrated"}, {"background"}});
  command->add_option("--out", common.out, "Session folder to make; it must not hold a session yet")
      ->required();
  add_settings(
      *command, request,
      {{"outputs",
        "What to measure while recording: force, surface (default: force, and surface where the sensor can)"},
       {"solver", "Surface solver: live (default) or best"},
       {"fixed_light"},
       {"frames"},
       {"seconds"},
       {"rate_Hz",
        "Play a recording at that many frames a second, as a camera would (default: as fast as all of it can "
        "be measured and written)"},
       {"sequence"},
       {"patience_s"},
       {"logs"},
       {"no_drop"}});
  command->add_flag(
      "--mcap", request.mcap,
      "recording.mcap in the session's folder too: images, depth, wrench and all measurements, as "
      "ROS 2 and Foxglove read them");
  options->pair.add_to(*command);
  options->block.add_to(*command);
  options->serve.add_to(*command);
  options->trace.add_to(*command);
  add_common(
      *command, common,
      "  palpate record --camera /dev/video0 --sensor pad.json --out out/press1     until Ctrl-C\n"
      "  palpate record --camera /dev/video0 --seconds 20 --out out/grid            uncalibrated\n"
      "  palpate record synthetic:palpation --out out/session\n"
      "  palpate record --camera left=1-2 --camera right=1-3 --grip grip.json --out out/two\n"
      "  palpate record --left synthetic:grip?side=left --right synthetic:grip?side=right --out out/grip\n"
      "A session is whole after every crash but its last second; `palpate process`, `replay` and `export`\n"
      "take it without any other file. See capture/session/README.md.\n");
  command->runs(chosen, [&common, options] { return record(common, *options); });
}

}  // namespace palpate
