#include "viz/commands/calibrate/balls.h"

#include "palpate/error.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/options.h"
#include "viz/commands/progress.h"

namespace palpate {

void add_ball_options(CommandLine& command, BallOptions& options, Common& common, const std::string& input,
                      const std::string& start) {
  command.add_option("INPUT", options.input, input)->required()->check(input_exists);
  command.add_option("--sensor", options.sensor,
                     "Sensor file to start from: " + start + " (default: only what the pictures say)");
  command.add_option("--pitch", options.pitch_mm_per_px, "Scale, mm per px (default: the sensor file's)")
      ->check(Check::range(1e-6, 100.0));
  command.add_option("--ball-mm", options.ball_mm, "Radius of the ball, mm; its contacts are found")
      ->check(Check::range(0.01, 1000.0));
  command.add_option("--balls", options.balls,
                     std::string("Table of presses instead, px of the rectified frame: ") + kBallColumns);
  command
      .add_option(
          "--background", options.background,
          "Untouched image, kept beside --out (default: the sensor file's, or a video's first frames)")
      ->check(Check::existing_file());
  command.add_option("--every", options.every,
                     "Look at every n-th frame (default: so that 400 are looked at)");
  command.add_option("--out", common.out, "Sensor file to write")->required()->option_text("FILE (required)");
}

void check_ball_options(const BallOptions& options) {
  if (options.balls.empty() == (options.ball_mm == 0))
    throw Error(Failure::Usage, "the ball's radius (--ball-mm) or a table of presses (--balls)",
                options.balls.empty() ? "neither" : "both", "--ball-mm RADIUS");
}

Sensor with_background(Sensor sensor, const BallOptions& options) {
  if (!options.background.empty())
    sensor.background.image = std::filesystem::absolute(options.background).string();
  return sensor;
}

BallPresses presses_of(const Common& common, const BallOptions& options, const Sensor& sensor,
                       bool mask_markers, size_t least) {
  if (!options.balls.empty()) return read_presses(options.balls, options.input, sensor, mask_markers);
  PressSearch search;
  search.ball_radius_mm = options.ball_mm;
  search.mask_markers = mask_markers;
  search.every = options.every;
  ProgressBar bar(common, "looking for the ball", 0);
  search.progress = [&](uint64_t done, uint64_t) {
    bar.update(done);
    return interrupted();
  };
  return find_presses(options.input, sensor, search, least);
}

}  // namespace palpate
