// A program of commands: one command line in, one report out, every failure one line and a documented exit
// code.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "viz/commands/support/common.h"

namespace palpate {

/// A command, or an option of one, that another program has now.
struct MovedCommand {
  const char* old;  ///< its words: "lump train", or "profile --compile"
  const char* now;  ///< the whole command that does it: "palpate-lab train"
};

struct Program {
  const char* name;      ///< as it is typed
  const char* about;     ///< one sentence
  const char* examples;  ///< lines
  /// In the order of the help.
  std::vector<void (*)(CommandLine& program, Common& common, Command& chosen)> commands;
  /// Action without a command; null: a command must be given.
  Command (*start)(Common& common) = nullptr;
  /// Why it cannot do that here; empty: it can.
  std::string (*no_start)() = nullptr;
  std::span<const MovedCommand> moved = {};
};

/// The program's main function; returns its exit code.
int run_program(const Program& program, int argc, char** argv);

}  // namespace palpate
