// Options of the command line for the settings of a run, from their table.
#pragma once

#include <initializer_list>

#include "capture/run/run_settings.h"

namespace palpate {

class CommandLine;

/// A setting that a command has, by its name in the table; `sentence`: in place of the table's, where the
/// command's default is another one.
struct WantedSetting {
  const char* name;
  const char* sentence = nullptr;
};

/// Adds them in this order. The settings must outlive the parsing.
void add_settings(CommandLine& command, RunSettings& settings, std::initializer_list<WantedSetting> wanted);
/// --sequence, with the table's words, of a command whose settings are its own.
void add_sequence(CommandLine& command, bool& one_sequence);

}  // namespace palpate
