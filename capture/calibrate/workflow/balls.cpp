#include "capture/calibrate/workflow/balls.h"

#include "palpate/error.h"

namespace palpate {

void check_ball_options(const BallRequest& options) {
  if (options.balls.empty() == (options.ball_mm == 0))
    throw Error(Failure::Usage, "the ball's radius (--ball-mm) or a table of presses (--balls)",
                options.balls.empty() ? "neither" : "both", "--ball-mm RADIUS");
}

Sensor with_background(Sensor sensor, const BallRequest& options) {
  if (!options.background.empty())
    sensor.background.image = std::filesystem::absolute(options.background).string();
  return sensor;
}

BallPresses presses_of(const CalibrationRun& run, const BallRequest& options, const Sensor& sensor,
                       bool mask_markers, size_t least) {
  if (!options.balls.empty()) return read_presses(options.balls, options.input, sensor, mask_markers);
  PressSearch search;
  search.ball_radius_mm = options.ball_mm;
  search.mask_markers = mask_markers;
  search.every = options.every;
  const RunWatch::Progress progress = run.watch.begin("looking for the ball", 0);
  search.progress = [&](uint64_t done, uint64_t) {
    progress(done);
    return run.watch.stopped();
  };
  return find_presses(options.input, sensor, search, least);
}

}  // namespace palpate
