#include "viz/commands/calibrate/balls.h"

#include "capture/calibrate/presses.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_ball_options(CommandLine& command, BallRequest& options, Common& common, const std::string& input,
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

}  // namespace palpate
