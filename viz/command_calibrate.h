// The commands below palpate calibrate, each in a file of its own.
#pragma once

#include "viz/command.h"

namespace palpate {

/// Each adds one command to the group `calibrate`.
void add_calibrate_force(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_shear(CLI::App& group, Common& common, Command& chosen);
void add_calibrate_photometric(CLI::App& group, Common& common, Command& chosen);

}  // namespace palpate
