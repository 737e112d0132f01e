#include "perf/profile/live.h"

#include <algorithm>

#include "capture/live/live.h"
#include "engine/gpu/context.h"
#include "perf/profile/frames.h"

namespace palpate::perf {
namespace {

/// Frames that are there already, so that making them takes no time from what is measured.
class SceneSource : public Source {
 public:
  SceneSource(Scene& scene, double rate_Hz) : scene_(scene), rate_Hz_(rate_Hz) {}
  FrameFormat format() const override { return scene_.background.format; }
  double rate_Hz() const override { return rate_Hz_; }
  std::optional<uint64_t> frame_count() const override { return std::nullopt; }
  bool next(Frame& frame) override {
    frame.reshape(format());
    frame.bytes = scene_.next().bytes;
    frame.sequence = next_;
    frame.time_ns = static_cast<int64_t>(1e9 * static_cast<double>(next_) / rate_Hz_);
    ++next_;
    return true;
  }

 private:
  Scene& scene_;
  double rate_Hz_;
  uint64_t next_ = 0;
};

}  // namespace

void measure_live(const gpu::ContextOptions& device, const std::vector<FrameSize>& sizes,
                  const MakeDrawer& drawer, double seconds, const Watch& watch, Profile& profile) {
  constexpr double kRates_Hz[] = {30, 60};
  gpu::Context context(device);
  constexpr double kLeast_s = 0.5;  // 15 frames of the slower camera; 0 would be without an end
  const double each_s =
      std::max(kLeast_s, seconds / static_cast<double>(sizes.size() * std::size(kRates_Hz)));
  for (const FrameSize& size : sizes) {
    Scene scene = timing_scene(size.width_px, size.height_px, SurfaceReading::Shading, kUsualTouch);
    const DrawResult draw = drawer(context, scene.sensor);
    for (const double rate_Hz : kRates_Hz) {
      if (watch.stopped()) return;
      std::vector<double> to_measured_ms, to_picture_ms;
      LiveOptions options;
      options.rate_Hz = rate_Hz;
      options.max_seconds = each_s;
      options.interrupted = watch.stopped;
      options.draw = draw;
      options.on_times = [&](const FrameTimes& times) {
        to_measured_ms.push_back(times.to_measured_ms());
        if (times.shown_ns != 0) to_picture_ms.push_back(times.to_shown_ms());
      };
      const LiveReport report = run_without_window(
          context, [&] { return std::make_unique<SceneSource>(scene, rate_Hz); },
          {scene.sensor, scene.background, {}}, options);
      if (to_picture_ms.empty()) continue;
      LiveFigure figure;
      figure.reading = to_string(SurfaceReading::Shading);
      figure.width_px = size.width_px;
      figure.height_px = size.height_px;
      figure.rate_Hz = rate_Hz;
      figure.frames = report.captured;
      figure.dropped_before_engine = report.dropped_before_engine;
      figure.dropped_before_display = report.dropped_before_display;
      figure.to_measured = distribution_of(to_measured_ms);
      figure.to_picture = distribution_of(to_picture_ms);
      profile.live.push_back(figure);
    }
    watch.say("latency of a live camera, " + size_text(size.width_px, size.height_px) + ": done");
  }
  watch.leave(context);
}

}  // namespace palpate::perf
