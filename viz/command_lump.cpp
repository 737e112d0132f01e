// palpate lump: the hidden lump, from data sets of presses to estimates.
#include "viz/command_lump.h"

#include <CLI/CLI.hpp>

namespace palpate {

void add_lump(CLI::App& program, Common& common, Command& chosen) {
  CLI::App* group =
      program.add_subcommand("lump", "Size, depth and stiffness of a lump in tissue from presses");
  group->require_subcommand(1);
  add_lump_dataset(*group, common, chosen);
  add_lump_info(*group, common, chosen);
}

}  // namespace palpate
