// Layout of a command's help: short enough for one look, or whole.
#pragma once

#include <string>
#include <vector>

namespace palpate {

struct HelpOption {
  std::string names;  ///< with the name of its value
  std::string about;
};

struct HelpGroup {
  std::string name;  ///< empty: the command's main options
  std::vector<HelpOption> options;
};

/// All that a command's help can say.
struct Help {
  std::string command;  ///< with the program's name
  std::string about;
  std::string usage;  ///< what follows the command
  std::vector<HelpOption> positional;
  std::vector<HelpOption> commands;  ///< below it
  std::vector<HelpGroup> groups;
  std::string examples;  ///< lines
  std::string notes;
};

inline constexpr size_t kHelpLines = 40, kHelpColumns = 100;

/// At most kHelpLines lines of kHelpColumns: each main option with the first part of what is to say of it,
/// of the groups the names.
std::string short_help(const Help& help);
/// Everything.
std::string whole_help(const Help& help);

}  // namespace palpate
