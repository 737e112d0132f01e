#include "viz/display/run_live.h"

#include <algorithm>
#include <optional>

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

LiveReport run_live(gpu::Context& context, const OpenSource& open, MeasuredRun run, LiveOptions options,
                    WindowRun shown) {
  std::optional<Window> own_window;
  if (!shown.window) {
    WindowOptions as{shown.title, shown.width, shown.height, shown.vsync};
    if (shown.settings) as.width = shown.settings->width, as.height = shown.settings->height;
    shown.window = &own_window.emplace(context, as);
  }
  Window& window = *shown.window;
  window.set_title(shown.title);
  options.reopen_device = [&window](gpu::Context& lost) -> gpu::Context& {
    window.detach();
    lost.reopen();
    window.attach();
    return lost;
  };
  // Current picture, pictures in flight, mailbox, engine.
  run.pipeline.slots =
      std::max(run.pipeline.slots, context.is_software() ? 4u : Window::kPicturesInFlight + 3);
  // It outlives a device that is lost.
  std::optional<GrowingMap> map;
  if (wants(run.pipeline.outputs, Output::Motion) && !run.pipeline.separate && has_scale(run.sensor))
    map.emplace(run.sensor.pitch_mm_per_px);
  const DisplayedSensor what{run.sensor, run.background, run.pipeline.outputs, run.pipeline.separate,
                             map ? &*map : nullptr};
  LiveSession session(Patience(options.patience_s, options.input));
  return run_session(session, context, open, run, options,
                     [&](LiveSession& of, LatencyLog& latency, const Pipeline&) {
                       return std::make_unique<WindowViewer>(context, what, options, shown, of, latency);
                     });
}

}  // namespace palpate::viz
