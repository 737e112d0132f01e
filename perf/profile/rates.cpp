#include "perf/profile/rates.h"

#include <algorithm>
#include <iterator>

#include "engine/gpu/context.h"
#include "perf/profile/paced.h"

namespace palpate::perf {
namespace {

constexpr Outputs kNumbers = Output::Force | Output::Contacts;
constexpr PacedScene kScenes[] = {
    {"waveguide: force, contacts", "synthetic:fingers?size=320x240&rate=1000", kNumbers},
    {"waveguide: surface too", "synthetic:fingers?size=320x240&rate=480", kNumbers | Output::Surface},
    {"colour gel: force, contacts", "synthetic:fingers?size=320x240&mode=gel&rate=480", kNumbers},
    {"colour gel: surface too", "synthetic:fingers?size=320x240&mode=gel&rate=240",
     kNumbers | Output::Surface},
    {"colour gel: force, contacts", "synthetic:fingers?size=640x480&mode=gel&rate=240", kNumbers},
    {"colour gel: surface too", "synthetic:fingers?size=640x480&mode=gel&rate=120",
     kNumbers | Output::Surface}};
constexpr double kLeast_s = 0.4;  // of a scene
constexpr double kPaced = 0.7;    // of a scene's time; the rest is as fast as it goes

}  // namespace

void measure_rates(const gpu::ContextOptions& device, double seconds, const Watch& watch, Profile& profile) {
  const double each_s = seconds / static_cast<double>(std::size(kScenes));
  if (each_s < kLeast_s) return skip("rates of fast cameras", watch, profile);
  gpu::Context context(device);
  for (const PacedScene& scene : kScenes) {
    if (watch.stopped()) return;
    const double start_s = wall_now_s();
    const Film film(scene);
    const double left_s = std::max(kLeast_s, each_s - (wall_now_s() - start_s));
    auto figure = film.figure<RateFigure>();
    Ages ages(kWarmUpFrames);
    LiveOptions live;
    live.max_seconds = kPaced * left_s;
    live.interrupted = watch.stopped;
    live.on_times = [&](const FrameTimes& times) { ages.add(times); };
    const LiveReport report = film.run(context, scene.outputs, live);
    if (ages.empty()) continue;
    ages.into(report, figure);
    figure.frames_per_s = film.frames_per_s(context, scene.outputs, (1 - kPaced) * left_s, watch.stopped);
    profile.rates.push_back(figure);
  }
  watch.say("rates of fast cameras: done");
  watch.leave(context);
}

}  // namespace palpate::perf
