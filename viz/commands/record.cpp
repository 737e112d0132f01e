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
#include "viz/commands/option_groups/sequence_option.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/run_watch.h"

namespace palpate {
namespace {

struct Options {
  std::string input;
  CameraChoice camera;
  std::filesystem::path sensor;
  std::filesystem::path background;
  std::vector<Output> outputs;
  SurfaceSolver solver = SurfaceSolver::Live;
  bool fixed_light = false;
  bool one_sequence = false;
  SessionOptions session;
  BlockChoice block;
  LiveOptions live;
};

Report record(const Common& common, Options options) {
  const std::string from = options.camera.input(options.input);
  if (from.empty())
    throw Error(Failure::Usage, "INPUT or --camera NODE", "neither", "palpate cameras, which lists them");
  MeasuredInput input = find_input(common.seed, from, options.sensor, options.background);
  ask_for(input, options.outputs);
  const PipelineOptions pipeline{
      .outputs = input.outputs, .solver = options.solver, .fixed_light = options.fixed_light};
  options.live.on_device_lost = [](const DeviceLost& lost) {
    spdlog::warn("{}; opened anew, the recording goes on", lost.what());
  };
  std::unique_ptr<gpu::Context> context;
  const auto device = [&]() -> gpu::Context& {
    context = open_device(common);
    return *context;
  };
  const auto [report, session] = record_session(
      device,
      {.input = input,
       .pipeline = pipeline,
       .one_sequence = options.one_sequence,
       .folder = common.out,
       .session = options.session,
       .live = options.live,
       .watch = [&](const Frame& background) { return monitor_presses(options.block, input, background); }},
      run_watch(common));
  for (const PressAnswer& press : report.presses)
    viz::append_event(common.out, {press.last_frame, press.time_s, "lump", describe(press)});
  const std::string& error = session.status.error;
  if (!error.empty()) spdlog::error("the recording ended early: {}", error);

  json::Value value = {
      {"input", input.input}, {"sensor", input.sensor.name}, {"device", context->report().name}};
  value.update(to_json(report, {session}));
  value["complete"] = !report.interrupted && error.empty();
  return {describe(report, {session}), value.dump(2, json::Utf8::Replace),
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
  command->add_option("INPUT", options->input, "Video, folder of images, session, or synthetic:SCENE");
  options->camera.add_to(*command);
  command->add_option("--sensor", options->sensor,
                      "Sensor file; a camera without one is recorded as it is, uncalibrated");
  command
      ->add_option("--background", options->background,
                   "Untouched image (default: the sensor file's, or the first frames)")
      ->check(Check::existing_file());
  command->add_option("--out", common.out, "Session folder to make; it must not hold a session yet")
      ->required();
  command
      ->add_option("--outputs", options->outputs,
                   "What to measure while recording: force, surface (default: force, and surface where the "
                   "sensor can)")
      ->delimiter(',')
      ->transform(one_of(kOutputNames));
  command
      ->add_option("--solver", options->solver,
                   "Surface solver: live (default), fine, converged, exact (CPU) or auto")
      ->transform(one_of(kSolverNames));
  command->add_flag(
      "--fixed-background", options->fixed_light,
      "A colour gel's frames are compared with the untouched image as they are: exposure, white "
      "balance and lamps that change are not followed");
  command->add_option("--frames", options->live.max_frames, "End after that many frames");
  command->add_option("--seconds", options->live.max_seconds, "End after that many seconds")
      ->check(Check::positive());
  command
      ->add_option("--rate", options->live.rate_Hz,
                   "Play a recording at that many frames a second, as a camera would (default: as fast as "
                   "all of it can be measured and written)")
      ->check(Check::positive());
  add_sequence(*command, options->one_sequence);
  command->add_flag("--no-drop", options->session.no_drop,
                    "Let frames wait for the recorder instead of dropping them from the recording");
  options->block.add_to(*command);
  add_common(
      *command, common,
      "  palpate record --camera /dev/video0 --sensor pad.json --out out/press1     until Ctrl-C\n"
      "  palpate record --camera /dev/video0 --seconds 20 --out out/grid            uncalibrated\n"
      "  palpate record synthetic:palpation --out out/session\n"
      "A session is whole after every crash but its last second; `palpate process`, `replay` and `export`\n"
      "take it without any other file. See capture/session/README.md.\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return record(common, *options); }; });
}

}  // namespace palpate
