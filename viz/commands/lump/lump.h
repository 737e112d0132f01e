// The commands below palpate lump, each in a file of its own.
#pragma once

#include "viz/commands/command.h"

namespace palpate {

/// Each adds one command to the group `lump`.
void add_lump_dataset(CLI::App& group, Common& common, Command& chosen);
void add_lump_info(CLI::App& group, Common& common, Command& chosen);
void add_lump_train(CLI::App& group, Common& common, Command& chosen);
void add_lump_estimate(CLI::App& group, Common& common, Command& chosen);
void add_lump_evaluate(CLI::App& group, Common& common, Command& chosen);
void add_lump_figures(CLI::App& group, Common& common, Command& chosen);
void add_lump_stability(CLI::App& group, Common& common, Command& chosen);
void add_lump_scan(CLI::App& group, Common& common, Command& chosen);

}  // namespace palpate
