// The commands below palpate calibrate, each in a file of its own.
#pragma once

#include <string>

#include "viz/commands/command.h"

namespace palpate {

class CommandLine;

/// For CLI's `check`: an input that is neither a camera nor synthetic has to exist. Empty: it does.
std::string input_exists(const std::string& input);

/// Each adds one command to the group `calibrate`.
void add_calibrate_background(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_flat(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_scale(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_force(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_shear(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_photometric(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_lookup(CommandLine& group, Common& common, Command& chosen);
void add_calibrate_lights(CommandLine& group, Common& common, Command& chosen);

}  // namespace palpate
