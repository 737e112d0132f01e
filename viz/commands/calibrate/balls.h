// Common parts of the commands that calibrate a surface by presses of a known ball: photometric and lookup.
#pragma once

#include <filesystem>
#include <string>

#include "capture/calibrate/presses.h"
#include "viz/commands/command.h"

namespace palpate {

class CommandLine;

struct BallOptions {
  std::string input;
  std::filesystem::path sensor, balls, background;
  double ball_mm = 0;
  double pitch_mm_per_px = 0;  ///< 0: the sensor file's
  uint64_t every = 0;
};

/// INPUT (`input` says what it may be), --sensor (`start`: what it has to hold), --ball-mm, --balls,
/// --background,
/// --every and --out.
void add_ball_options(CommandLine& command, BallOptions& options, Common& common, const std::string& input,
                      const std::string& start);

/// Throws Error(Failure::Usage) unless the presses are either found by a radius or named by a table.
void check_ball_options(const BallOptions& options);

/// The sensor with the untouched image that --background names.
Sensor with_background(Sensor sensor, const BallOptions& options);

/// The presses that the table names, or those that are found, `least` or more, with a progress bar. Throws as
/// read_presses and find_presses do.
BallPresses presses_of(const Common& common, const BallOptions& options, const Sensor& sensor,
                       bool mask_markers, size_t least);

}  // namespace palpate
