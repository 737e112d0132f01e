#include "perf/profile/live.h"

#include <algorithm>

#include "engine/gpu/context.h"
#include "perf/profile/frames.h"
#include "perf/profile/paced.h"

namespace palpate::perf {
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
      Ages ages;
      LiveOptions options;
      options.rate_Hz = rate_Hz;
      options.max_seconds = each_s;
      options.interrupted = watch.stopped;
      options.draw = draw;
      options.on_times = [&](const FrameTimes& times) { ages.add(times); };
      const LiveReport report = run_without_window(
          context,
          [&] {
            return std::shared_ptr<Source>(
                frames_in_memory([&]() -> const Frame& { return scene.next(); }, rate_Hz));
          },
          {scene.sensor, scene.background, {}}, options);
      LiveFigure figure;
      figure.reading = to_string(SurfaceReading::Shading);
      figure.width_px = size.width_px;
      figure.height_px = size.height_px;
      figure.rate_Hz = rate_Hz;
      ages.into(report, figure);
      if (figure.to_picture.samples > 0) profile.live.push_back(figure);
    }
    watch.say("latency of a live camera, " + size_text(size.width_px, size.height_px) + ": done");
  }
  watch.leave(context);
}

}  // namespace palpate::perf
