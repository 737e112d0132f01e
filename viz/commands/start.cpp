// palpate without a command: the list of sources in a window, and the chosen source in the same window.
#include <atomic>
#include <chrono>
#include <future>
#include <utility>

#include "capture/open_source.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/live_run.h"
#include "viz/commands/progress.h"
#include "viz/live/live_report.h"
#include "viz/panels/start_view.h"
#include "viz/render/window.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

/// Opens the choice while the window stays alive; none where the person gave up.
std::optional<OpenInput> open_choice(const Common& common, const LiveRunRequest& request,
                                     viz::StartView& view) {
  std::atomic<bool> cancelled{false};
  std::future<OpenInput> opening = std::async(std::launch::async, [&] {
    return open_input(common, request, [&cancelled] { return cancelled || interrupted(); });
  });
  const bool kept = view.wait(request.input, [&] {
    return interrupted() || opening.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  });
  cancelled = !kept;
  OpenInput opened = opening.get();
  if (!kept) return std::nullopt;
  opened.source->watch(interrupted);  // the flag above goes
  return opened;
}

LiveRunRequest request_of(const viz::Choice& choice, const fs::path& folder, viz::Window& window,
                          viz::Settings& settings) {
  LiveRunRequest request;
  request.input = choice.input;
  request.sensor = choice.sensor;
  request.recordings = folder;
  request.live.title = "palpate: " + choice.input;
  request.live.window = &window;
  request.live.settings = &settings;
  request.live.from_list = true;
  request.live.interrupted = interrupted;
  request.live.replay = is_recording(choice.input);
  return request;
}

Report start(const Common& common) {
  const std::vector<const char*> extensions = viz::window_extensions();
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  Remembered remembered;
  viz::Settings& settings = remembered.settings;
  viz::Window window(*context, {"palpate", settings.width, settings.height, viz::Vsync::On});
  const fs::path folder = recordings_folder(settings);
  viz::StartTrouble trouble{remembered.warning, {}};
  std::string text;
  while (!window.close_requested() && !interrupted()) {
    LiveRunRequest request;
    std::optional<OpenInput> opened;
    {
      viz::StartView view(*context, window, settings, std::exchange(trouble, {}), folder.string());
      const std::optional<viz::Choice> choice = view.choose(interrupted);
      if (!choice) break;
      request = request_of(*choice, folder, window, settings);
      try {
        opened = open_choice(common, request, view);
      } catch (const std::exception& e) {
        trouble = {e.what(), *choice};
      }
    }
    if (!opened) continue;
    settings.remember(request.input, request.sensor);
    try {
      const LiveRunReport run = run_live_input(*context, std::move(request), std::move(*opened));
      text += run.measured.input + ": " + describe(run.live, run.sessions);
      trouble.message = recording_error(run.sessions);
      if (!run.live.sources_requested) break;
    } catch (const Error& e) {
      // A camera that is gone or a damaged file: back to the list, with a reason.
      if (e.failure() == Failure::Display) throw;
      trouble.message = e.what();
    }
    remembered.save();
  }
  std::tie(settings.width, settings.height) = window.size();
  return {text, json::Value{{"complete", true}}.dump(),
          interrupted()                ? kInterrupted
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

}  // namespace

Command start_command(Common& common) {
  return [&common] { return start(common); };
}

}  // namespace palpate
