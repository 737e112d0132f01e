#include "viz/commands/calibrate/balls.h"

#include <algorithm>
#include <filesystem>

#include "capture/calibrate/photometric/presses.h"
#include "palpate/error.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_ball_size(CommandLine& command, BallSize& ball, const std::string& use) {
  const auto in_range = Check::range(1e-3, 1000.0);
  command.add_option("--ball-radius-mm", ball.radius_mm, "Radius of the " + use)->check(in_range);
  command.add_option("--ball-diameter-mm", ball.diameter_mm, "Or its diameter")->check(in_range);
  command
      .add_option("--ball-mm", ball.unsaid_mm,
                  "Its radius, by the older name: refused where the pictures show that it is the diameter")
      ->check(in_range);
}

void take_table(BallRequest& options) {
  const auto table = std::ranges::find_if(options.other_balls, [](const std::string& entry) {
    return entry.find('=') == std::string::npos || std::filesystem::exists(entry);
  });
  if (table == options.other_balls.end()) return;
  if (options.other_balls.size() > 1)
    throw Error(Failure::Usage, "one table of presses, or RECORDING=RADIUS_MM of each further ball",
                "'" + *table + "' with others", "--balls presses_5mm=2.5");
  options.balls = *table;
  options.other_balls.clear();
}

void add_ball_options(CommandLine& command, BallRequest& options, Common& common, const std::string& input,
                      const std::string& start) {
  command.add_option("INPUT", options.input, input)->required()->check(input_exists);
  command.add_option("--sensor", options.sensor,
                     "Sensor file to start from: " + start + " (default: only what the pictures say)");
  command.add_option("--pitch", options.pitch_mm_per_px, "Scale, mm per px (default: the sensor file's)")
      ->check(Check::range(1e-6, 100.0));
  add_ball_size(command, options.ball, "ball; its contacts are found");
  command.add_option("--balls", options.other_balls,
                     std::string("RECORDING=RADIUS_MM: presses of another ball, as often as there are; or a "
                                 "table of presses instead, px of the rectified frame: ") +
                         kBallColumns);
  command
      .add_option(
          "--background", options.background,
          "Untouched image, kept next to --out (default: the sensor file's, or a video's first frames)")
      ->check(Check::existing_file());
  command.add_option("--every", options.every,
                     "Look at every n-th frame (default: so that 400 are looked at)");
  command.add_option("--out", common.out, "Sensor file to write")->required()->option_text("FILE (required)");
}

}  // namespace palpate
