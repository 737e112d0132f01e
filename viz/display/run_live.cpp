#include "viz/display/run_live.h"

#include <algorithm>
#include <optional>

#include "capture/live/live.h"
#include "engine/gpu/context.h"
#include "viz/display/display.h"
#include "viz/panels/settings.h"
#include "viz/render/window.h"

namespace palpate::viz {
namespace {

class WindowViewer : public LiveViewer {
 public:
  WindowViewer(gpu::Context& context, const DisplayedSensor& what, const LiveOptions& options,
               const WindowRun& shown, LiveSession& session, LatencyLog& latency)
      : display_(context, what, options, shown, session, latency) {}

  LiveReport run() override { return display_.run(); }
  void finish_presses() override { display_.finish_presses(); }

 private:
  Display display_;
};

}  // namespace

LiveReport run_live(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                    const Sensor& sensor, const Frame& background, PipelineOptions pipeline_options,
                    LiveOptions options, WindowRun shown) {
  std::optional<Window> own_window;
  if (!shown.window) {
    WindowOptions as{shown.title, shown.width, shown.height, shown.vsync};
    if (shown.settings) as.width = shown.settings->width, as.height = shown.settings->height;
    shown.window = &own_window.emplace(context, as);
  }
  Window& window = *shown.window;
  window.set_title(shown.title);
  options.reopen_device = [&window](gpu::Context& lost) {
    window.detach();
    lost.reopen();
    window.attach();
  };
  // Current picture, pictures in flight, mailbox, engine.
  pipeline_options.slots =
      std::max(pipeline_options.slots, context.is_software() ? 4u : Window::kPicturesInFlight + 3);
  const DisplayedSensor what{sensor, background, pipeline_options.outputs, pipeline_options.separate};
  return run_session(context, open, sensor, background, pipeline_options, options,
                     [&](LiveSession& session, LatencyLog& latency) {
                       return std::make_unique<WindowViewer>(context, what, options, shown, session, latency);
                     });
}

}  // namespace palpate::viz
