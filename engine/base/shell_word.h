// Words of commands that people copy into a shell.
#pragma once

#include <string>

namespace palpate {

/// A word as a shell takes it: in quotes where it needs them.
std::string in_quotes(const std::string& word);

}  // namespace palpate
