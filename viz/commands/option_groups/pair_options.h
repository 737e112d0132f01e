// Options of the command line for two fingers.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "capture/pair/pair_session.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/camera_options.h"

namespace palpate {

struct PairChoice {
  std::string left, right;  ///< inputs
  std::filesystem::path left_sensor, right_sensor;
  std::filesystem::path grip;

  /// Adds --left, --right, --left-sensor, --right-sensor, --grip. The choice must outlive the parsing.
  void add_to(CommandLine& command);
  /// The settings of both fingers where two are asked for: `settings` with the inputs of either, from the
  /// options above or --camera left=NAME and right=NAME; none: one input is. Throws Error(Failure::Usage)
  /// where one of the two is missing or there is a third.
  std::optional<std::array<RunSettings, 2>> fingers(const RunSettings& settings,
                                                    const CameraChoice& camera) const;
  /// Of these fingers and the grip; a lost device and a finger without frames are lines of the log. `run`:
  /// what goes on then.
  PairRequest request(std::array<RunSettings, 2> fingers, const std::string& run) const;
};

/// Facts of a pair's run, for people and programs.
Facts facts_of(const PairOutcome& outcome);

}  // namespace palpate
