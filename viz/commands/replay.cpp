// palpate replay: a recorded session in the window of `live`, with the keys of a player.

#include "capture/files/event_log.h"
#include "capture/files/measurements.h"
#include "capture/open_source.h"
#include "capture/run/input.h"
#include "capture/session/session.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/live_run.h"
#include "viz/commands/option_groups/block_options.h"
#include "viz/commands/options.h"
#include "viz/commands/progress.h"
#include "viz/display/run_live.h"
#include "viz/live/live_report.h"
#include "viz/render/window.h"

namespace palpate {
namespace {

struct Options {
  std::filesystem::path session;
  std::filesystem::path sensor;
  std::optional<SurfaceSolver> solver;
  double from_s = 0;
  BlockChoice block;
  viz::LiveOptions live;
};

Report replay(const Common& common, Options options) {
  const std::vector<const char*> extensions = viz::window_extensions();
  if (!is_session(options.session))
    throw Error(Failure::Input, "a session folder", "'" + options.session.string() + "', which is none",
                "palpate live for other recordings, or palpate record to make a session");
  const MeasuredInput input = find_input(common.seed, options.session.string(), options.sensor);
  auto session = std::make_unique<Session>(options.session, input.sensor);
  const Frame background = load_background(input.input, input.sensor, *session);
  const std::unique_ptr<PressMonitor> presses = monitor_presses(
      options.block, input, background, options.live.loop ? session->frame_count().value_or(0) : 0);
  options.live.presses = presses.get();
  if (options.from_s > 0) {
    const auto index = static_cast<uint64_t>(options.from_s * session->rate_Hz());
    if (!session->seek(index))
      throw Error(Failure::Usage, "--from within the session",
                  std::to_string(options.from_s) + " s of " +
                      std::to_string(session->frame_count().value_or(0)) + " frames",
                  "an earlier time");
  }
  PipelineOptions pipeline{.outputs = input.outputs,
                           .solver = options.solver.value_or(session->info().solver),
                           .skip_untouched = session->info().skip_untouched,
                           .fixed_light = session->info().fixed_light};
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  if (!common.out.empty()) options.live.snapshots = common.out;
  options.live.events = session_folder(options.session);
  for (const viz::Event& event : viz::read_events(options.live.events))
    options.live.known_events.push_back({event.time_s, viz::label_of(event)});
  Remembered remembered;
  remembered.settings.remember(options.session.string(), options.sensor);
  options.live.settings = &remembered.settings;
  options.live.title = "palpate: " + options.session.string();
  options.live.interrupted = interrupted;
  options.live.replay = true;
  if (common.jsonl) {
    const MeasuredColumns columns = MeasuredColumns::of(input.sensor, input.outputs);
    options.live.on_result = [columns](const Touch& touch) { print_line(json_line(touch, columns)); };
  }
  const std::string warning = session->warning();
  const auto open = [&]() -> std::unique_ptr<Source> {
    return session ? std::move(session) : std::make_unique<Session>(options.session, input.sensor);
  };
  const viz::LiveReport report =
      viz::run_live(*context, open, input.sensor, background, pipeline, options.live);
  json::Value value = {
      {"input", input.input}, {"sensor", input.sensor.name}, {"device", context->report().name}};
  value.update(to_json(report, {}));
  value["warning"] = warning;
  std::string text = describe(report, {});
  if (!warning.empty()) text += "warning: " + warning + "\n";
  return {text, value.dump(2, json::Utf8::Replace),
          report.interrupted           ? kInterrupted
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

}  // namespace

void add_replay(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "replay", "Show a recorded session: its own speed, faster, slower, step by step");
  auto options = std::make_shared<Options>();
  command->add_option("SESSION", options->session, "Session folder")->required();
  command->add_option("--sensor", options->sensor, "Another sensor file than the recorded one");
  command
      ->add_option("--solver", options->solver,
                   "Surface solver: live, fine, converged or exact (default: as recorded)")
      ->transform(one_of(kSolverNames));
  command->add_option("--speed", options->live.speed, "Times the recorded speed")
      ->capture_default_str()
      ->check(Check::range(viz::LiveOptions::kSlowest, viz::LiveOptions::kFastest));
  command->add_option("--from", options->from_s, "Start so many seconds into the session")
      ->check(Check::non_negative());
  command->add_option("--frames", options->live.max_frames, "End after that many frames");
  command->add_option("--seconds", options->live.max_seconds, "End after so long")->check(Check::positive());
  command->add_flag("--loop", options->live.loop, "Start again at its end");
  command->add_flag("--close", options->live.close_at_end, "Close the window at its end");
  command->add_option("--out", common.out, "Folder for snapshots");
  options->block.add_to(*command);
  add_common(
      *command, common,
      "  palpate replay out/press1\n"
      "  palpate replay out/press1 --speed 0.25 --from 3\n"
      "In the window: Space pauses, comma and full stop step, arrows jump and change the speed, H shows\n"
      "all keys. Measurements are computed anew; after a jump shear counts from there and says so.\n");
  add_jsonl(*command, common);
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return replay(common, *options); }; });
}

}  // namespace palpate
