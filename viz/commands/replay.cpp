// palpate replay: a recording in the window of `live`, with the keys of a player.
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "capture/live/live_report.h"
#include "capture/open_source.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/block_options.h"
#include "viz/commands/option_groups/sequence_option.h"
#include "viz/commands/support/live_run.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/render/desktop.h"

namespace palpate {
namespace {

struct Options {
  std::filesystem::path recording;
  std::filesystem::path sensor;
  std::filesystem::path background;
  std::optional<SurfaceSolver> solver;
  bool one_sequence = false;
  double from_s = 0;
  BlockChoice block;
  LiveOptions live;
};

/// Rate at which a recording is shown, as the player does.
double shown_rate_Hz(const Source& source, const LiveOptions& live) {
  if (live.rate_Hz > 0) return live.rate_Hz;
  return source.rate_Hz() > 0 ? source.rate_Hz() : kFolderRate_Hz;
}

/// The first frame at `from_s` or later; none: the recording is shorter.
std::optional<uint64_t> frame_from(const Source& source, double from_s, const LiveOptions& live) {
  const std::vector<double> times_s = live.rate_Hz > 0 ? std::vector<double>{} : source.uneven_times_s();
  const double place = times_s.empty()
                           ? from_s * shown_rate_Hz(source, live)
                           : static_cast<double>(std::ranges::lower_bound(times_s, from_s) - times_s.begin());
  if (place >= static_cast<double>(source.frame_count().value_or(0))) return std::nullopt;
  return static_cast<uint64_t>(place);
}

void start_at(Source& source, double from_s, const LiveOptions& live) {
  const std::optional<uint64_t> index = frame_from(source, from_s, live);
  if (!index || !source.seek(*index)) {
    const uint64_t frames = source.frame_count().value_or(0);
    const std::vector<double> times_s = source.uneven_times_s();
    throw Error(
        Failure::Usage, "--from within the recording",
        text("%g s of %llu frames, %.1f s", from_s, static_cast<unsigned long long>(frames),
             times_s.empty() || live.rate_Hz > 0 ? static_cast<double>(frames) / shown_rate_Hz(source, live)
                                                 : times_s.back()),
        "an earlier time");
  }
}

Report replay(const Common& common, const Options& options) {
  const std::vector<const char*> extensions = viz::window_extensions();
  if (!is_recording(options.recording.string()))
    throw Error(Failure::Input, "a recording: a session, a video or a folder of images",
                "'" + options.recording.string() + "'", "palpate live for cameras and simulated scenes");
  LiveRunRequest request;
  request.input = options.recording.string();
  request.sensor = options.sensor;
  request.background = options.background;
  request.solver = options.solver;
  request.one_sequence = options.one_sequence;
  request.block = options.block;
  request.live = options.live;
  OpenInput opened = open_input(common, request, interrupted);
  if (options.from_s > 0) start_at(*opened.source, options.from_s, options.live);
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  Remembered remembered;
  remembered.settings.remember(request.input, request.sensor);
  request.notes = common.out;
  request.recordings = recordings_folder(remembered.settings);
  request.shown.settings = &remembered.settings;
  request.shown.title = "palpate: " + request.input;
  request.live.interrupted = interrupted;
  request.live.replay = true;
  if (common.jsonl) request.on_row = print_line;
  const LiveRunReport run = run_live_input(*context, std::move(request), std::move(opened));
  json::Value value = {{"input", run.measured.input},
                       {"sensor", run.measured.sensor.name},
                       {"device", context->report().name}};
  value.update(to_json(run.live, {}));
  value["warning"] = run.live.warning;
  std::string text = describe(run.live, {});
  if (!run.live.warning.empty()) text += "warning: " + run.live.warning + "\n";
  return {text, value.dump(2, json::Utf8::Replace),
          run.live.interrupted         ? kInterrupted
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

}  // namespace

void add_replay(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("replay", "Show a recording at its own speed, faster, slower or step by step");
  auto options = std::make_shared<Options>();
  command->add_option("RECORDING", options->recording, "Session, video or folder of images")->required();
  command->add_option("--sensor", options->sensor, "Sensor file; a session has its own");
  command
      ->add_option("--background", options->background,
                   "Untouched image (default: the sensor file's, or the first frames)")
      ->check(Check::existing_file());
  command
      ->add_option("--solver", options->solver,
                   "Surface solver: live, fine, converged, exact or auto (default: as recorded, else live)")
      ->transform(one_of(kSolverNames));
  command->add_option("--speed", options->live.speed, "Multiple of the recorded speed")
      ->capture_default_str()
      ->check(Check::range(LiveOptions::kSlowest, LiveOptions::kFastest));
  command
      ->add_option("--rate", options->live.rate_Hz,
                   "Frames a second (default: the recording's own times, 10 for images)")
      ->check(Check::positive());
  add_sequence(*command, options->one_sequence);
  command->add_option("--from", options->from_s, "Start that many seconds into the recording")
      ->check(Check::non_negative());
  command->add_option("--frames", options->live.max_frames, "End after that many frames");
  command->add_option("--seconds", options->live.max_seconds, "End after that many seconds")
      ->check(Check::positive());
  command->add_flag("--loop", options->live.loop, "Start again at its end");
  command->add_flag("--close", options->live.close_at_end, "Close the window at its end");
  command->add_option("--out", common.out,
                      "Folder for snapshots and marks (default: the session's own, else one in ~/palpate)");
  options->block.add_to(*command);
  add_common(*command, common,
             "  palpate replay out/press1\n"
             "  palpate replay out/press1 --speed 0.25 --from 3\n"
             "  palpate replay press.avi --sensor gel.json\n"
             "In the window: Space pauses, comma and full stop step, arrows jump and change the speed, a "
             "click in the\n"
             "charts goes there, H shows all keys. Measurements are computed anew; after a jump shear counts "
             "from there and says so.\n");
  add_jsonl(*command, common);
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return replay(common, *options); }; });
}

}  // namespace palpate
