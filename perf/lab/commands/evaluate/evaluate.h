// palpate-lab evaluate, and what the commands below it share: options of the cells, a report of judged cases.
#pragma once

#include <cstdint>
#include <string>

#include "perf/lab/commands/commands.h"
#include "perf/lab/judge/cells.h"

namespace palpate {

class CommandLine;

/// Each adds one command to the group.
void add_evaluate_table(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_match(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_modulus(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_force(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_lump(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_change(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_methods(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_repeats(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_emulator(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_limit(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_pairs(CommandLine& group, Common& common, Command& chosen);
void add_evaluate_stiffness(CommandLine& group, Common& common, Command& chosen);

/// --by, --bins and --fewest. `conditions`: what --by may name, for its help.
void add_cell_options(CommandLine& command, judge::CellOptions& cells, const std::string& conditions);
/// --trials: of a simulation.
void add_trials(CommandLine& command, uint32_t& trials, const std::string& description);

/// Judges what was gathered, of `wanted` trials; with --out its files too, as `stem`. Fewer than wanted: by
/// Ctrl-C, which the report says.
Report judged_report(const Common& common, const judge::Cases& cases, judge::CellOptions cells,
                     const std::string& stem, size_t trials, size_t wanted);

}  // namespace palpate
