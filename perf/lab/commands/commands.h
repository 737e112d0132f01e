// Commands of the program palpate-lab: the function that adds each.
#pragma once

#include "viz/commands/support/common.h"

namespace palpate {

/// Each adds one command to the program; `chosen` is what to run once the command line is parsed.
void add_dataset(CommandLine& program, Common& common, Command& chosen);
void add_info(CommandLine& program, Common& common, Command& chosen);
void add_train(CommandLine& program, Common& common, Command& chosen);
void add_evaluate(CommandLine& program, Common& common, Command& chosen);
void add_stability(CommandLine& program, Common& common, Command& chosen);
void add_figures(CommandLine& program, Common& common, Command& chosen);
void add_forward(CommandLine& program, Common& common, Command& chosen);
void add_tune(CommandLine& program, Common& common, Command& chosen);
void add_compile(CommandLine& program, Common& common, Command& chosen);
void add_goals(CommandLine& program, Common& common, Command& chosen);
void add_bench(CommandLine& program, Common& common, Command& chosen);

}  // namespace palpate
