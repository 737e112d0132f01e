// Common parts of the commands that calibrate a surface by presses of a known ball: photometric and lookup.
#pragma once

#include <string>

#include "capture/calibrate/workflow/workflow.h"
#include "viz/commands/command.h"

namespace palpate {

class CommandLine;

/// --ball-radius-mm, --ball-diameter-mm and the older --ball-mm; `use`: what the ball is for.
void add_ball_size(CommandLine& command, BallSize& ball, const std::string& use);

/// Moves a table of presses among the values of --balls to where it belongs. Throws Error(Failure::Usage).
void take_table(BallRequest& options);

/// INPUT (`input` says what it may be), --sensor (`start`: what it has to hold), the ball's size, --balls,
/// --background, --every and --out.
void add_ball_options(CommandLine& command, BallRequest& options, Common& common, const std::string& input,
                      const std::string& start);

}  // namespace palpate
