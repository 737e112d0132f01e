// The commands below palpate calibrate, each in a file of its own.
#pragma once

#include <string>

#include "viz/commands/command.h"

namespace palpate {

/// For CLI's `check`: an input that is neither a camera nor synthetic has to exist. Empty: it does.
std::string input_exists(const std::string& input);

/// Each adds one command to the group `calibrate`.
void add_calibrate_background(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_flat(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_scale(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_force(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_shear(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_photometric(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_lookup(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_lights(CLI::App& group, Common& common, Command& chosen);

}  // namespace palpate
