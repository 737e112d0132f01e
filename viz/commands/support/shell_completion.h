// The command completion: what completes a program's command line in bash, zsh and fish. The shells ask the
// program itself, by `palpate complete WORD...`, so that what they offer is what this version has.
#pragma once

#include <string>
#include <vector>

#include "viz/commands/support/common.h"

namespace palpate {

/// How a command line that is being typed may go on: a line "WORD<tab>about" each, and ":files" or ":folders"
/// where such names may follow.
std::string completions(const CommandLine& program, const std::vector<std::string>& words);

/// Adds the command `completion` to the program of that name.
void add_completion(CommandLine& program, Common& common, Command& chosen, const std::string& name);

}  // namespace palpate
