// The commands below palpate lump, each in a file of its own.
#pragma once

#include "viz/commands/command.h"

namespace palpate {

class CommandLine;

/// Each adds one command to the group `lump`.
void add_lump_estimate(CommandLine& group, Common& common, Command& chosen);
void add_lump_compare(CommandLine& group, Common& common, Command& chosen);
void add_lump_limit(CommandLine& group, Common& common, Command& chosen);
void add_lump_scan(CommandLine& group, Common& common, Command& chosen);

}  // namespace palpate
