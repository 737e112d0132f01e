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
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/trace_option.h"
#include "viz/commands/workflow/live_run.h"
#include "viz/render/desktop.h"

namespace palpate {
namespace {

struct Options {
  LiveRunRequest request;
  double from_s = 0;
  TraceOption trace;
};

/// Rate at which a recording is shown, as the player does.
double shown_rate_Hz(const Source& source, const LoopSettings& live) {
  if (live.rate_Hz > 0) return live.rate_Hz;
  return source.rate_Hz() > 0 ? source.rate_Hz() : kFolderRate_Hz;
}

/// The first frame at `from_s` or later; none: the recording is shorter.
std::optional<uint64_t> frame_from(const Source& source, double from_s, const LoopSettings& live) {
  const std::vector<double> times_s = live.rate_Hz > 0 ? std::vector<double>{} : source.uneven_times_s();
  const double place = times_s.empty()
                           ? from_s * shown_rate_Hz(source, live)
                           : static_cast<double>(std::ranges::lower_bound(times_s, from_s) - times_s.begin());
  if (place >= static_cast<double>(source.frame_count().value_or(0))) return std::nullopt;
  return static_cast<uint64_t>(place);
}

void start_at(Source& source, double from_s, const LoopSettings& live) {
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
  LiveRunRequest request = options.request;
  request.seed = common.seed;
  request.replay = true;
  if (!is_recording(request.input))
    throw Error(Failure::Input, "a recording: a session, a video or a folder of images",
                "'" + request.input + "'", "palpate live for cameras and simulated scenes");
  OpenInput opened = open_input(request, interrupted);
  if (options.from_s > 0) start_at(*opened.source, options.from_s, request);
  const std::unique_ptr<TraceFile> trace = options.trace.start();
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  Remembered remembered;
  remembered.settings.remember(request.input, request.sensor);
  request.notes = common.out;
  request.recordings = recordings_folder(remembered.settings);
  request.shown.settings = &remembered.settings;
  request.shown.title = "palpate: " + request.input;
  if (common.jsonl) request.on_row = print_line;
  const LiveRunReport run = run_live_input(*context, std::move(request), std::move(opened));
  return report_of(run, *context);
}

}  // namespace

void add_replay(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("replay", "Show a recording at its own speed, faster, slower or step by step");
  auto options = std::make_shared<Options>();
  LiveRunRequest& request = options->request;
  command->add_option("RECORDING", request.input, "Session, video or folder of images")
      ->required()
      ->takes_path();
  add_settings(*command, request,
               {{"sensor", "Sensor file; a session has its own"},
                {"background"},
                {"solver", "Surface solver: live or best (default: as recorded, else live)"},
                {"speed"},
                {"rate_Hz", "Frames a second (default: the recording's own times, 10 for images)"},
                {"sequence"}});
  command->add_option("--from", options->from_s, "Start that many seconds into the recording")
      ->check(Check::non_negative());
  add_settings(*command, request,
               {{"frames"},
                {"seconds"},
                {"loop", "Start again at its end"},
                {"close", "Close the window at its end"}});
  command->add_option("--out", common.out,
                      "Folder for snapshots and marks (default: the session's own, else one in ~/palpate)");
  request.block.add_to(*command);
  options->request.serve.add_to(*command);
  options->trace.add_to(*command);
  add_common(*command, common,
             "  palpate replay out/press1\n"
             "  palpate replay out/press1 --speed 0.25 --from 3\n"
             "  palpate replay press.avi --sensor gel.json\n"
             "In the window: Space pauses, comma and full stop step, arrows jump and change the speed, a "
             "click in the\n"
             "charts goes there, H shows all keys. Measurements are computed anew; after a jump shear counts "
             "from there and says so.\n");
  add_jsonl(*command, common);
  command->runs(chosen, [&common, options] { return replay(common, *options); });
}

}  // namespace palpate
