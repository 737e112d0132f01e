// palpate without a command: the list of sources in a window, and the chosen source in the same window.
#include <atomic>
#include <chrono>
#include <future>
#include <utility>

#include "capture/live/live_report.h"
#include "capture/open_source.h"
#include "capture/synthetic/object_options.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/workflow/live_run.h"
#include "viz/commands/workflow/setup_window.h"
#include "viz/panels/start/start_view.h"
#include "viz/render/desktop.h"
#include "viz/render/window.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

/// Opens the choice while the window stays alive; none where the person gave up.
std::optional<OpenInput> open_choice(const LiveRunRequest& request, viz::StartView& view) {
  std::atomic<bool> cancelled{false};
  std::future<OpenInput> opening = std::async(std::launch::async, [&] {
    return open_input(request, [&cancelled] { return cancelled || interrupted(); });
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

LiveRunRequest request_of(const Common& common, const viz::Choice& choice, const fs::path& folder,
                          viz::Window& window, viz::Settings& settings) {
  LiveRunRequest request;
  static_cast<RunSettings&>(request) = settings.run;
  request.seed = common.seed;
  request.input = choice.input;
  request.sensor = choice.sensor;
  request.recordings = folder;
  request.shown.title = "palpate: " + choice.input;
  request.shown.window = &window;
  request.shown.settings = &settings;
  request.shown.from_list = true;
  request.replay = is_recording(choice.input);
  return request;
}

/// `setup`: with the form for a sensor of one's own in front.
Report start(const Common& common, const std::optional<SetupInputs>& setup) {
  const std::vector<const char*> extensions = viz::window_extensions();
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  Remembered remembered;
  viz::Settings& settings = remembered.settings;
  viz::Window window(*context, {"palpate", settings.width, settings.height, viz::Vsync::On});
  const fs::path folder = recordings_folder(settings);
  SetupWindow own_sensor(setup.value_or(SetupInputs{}), common.out, folder);
  viz::StartTrouble trouble{remembered.warning, {}};
  std::string text;
  bool in_setup = setup.has_value();
  while (!window.close_requested() && !interrupted()) {
    std::optional<viz::Choice> choice;
    if (std::exchange(in_setup, false)) choice = own_sensor.fill_in(*context, window, settings);
    if (window.close_requested() || interrupted()) break;
    LiveRunRequest request;
    std::optional<OpenInput> opened;
    {
      viz::StartView view(*context, window, settings, std::exchange(trouble, {}), folder.string());
      if (!choice) choice = view.choose(interrupted);
      if (!choice) break;
      if (choice->setup) {
        own_sensor.take_recording(choice->typed);
        in_setup = true;
        continue;
      }
      request = request_of(common, *choice, folder, window, settings);
      try {
        opened = open_choice(request, view);
      } catch (const std::exception& e) {
        trouble = {e.what(), *choice};
      }
    }
    if (!opened) continue;
    // What these show is how an object moves; of a sensor's recording it is asked for.
    if (is_object(request.input) && request.chosen_outputs.empty())
      opened->measured.outputs |= Output::Motion;
    settings.remember(request.input, request.sensor);
    try {
      const LiveRunReport run = run_live_input(*context, std::move(request), std::move(*opened));
      text += run.measured.input + ": " + facts_of(run.live, run.sessions).text;
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
  return {text, json::Value{{"complete", true}},
          interrupted()                ? kInterrupted
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

}  // namespace

Command start_command(Common& common) {
  return [&common] { return start(common, std::nullopt); };
}

Report setup_in_window(const Common& common, const SetupInputs& known) {
  return start(common, known);
}

}  // namespace palpate
