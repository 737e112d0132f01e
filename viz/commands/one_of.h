// A command line's word that stands for one of a few values.
#pragma once

#include <map>
#include <string>

#include "viz/commands/options.h"

namespace palpate {

/// Turns a name into its value; another word is refused with what there is. For CommandOption::transform of
/// an option that holds a Value (an enum, or several).
template <typename Value>
Check one_of(const std::map<std::string, Value>& names) {
  std::map<std::string, int> numbers;
  for (const auto& [name, value] : names) numbers[name] = static_cast<int>(value);
  return Check::number_of(numbers);
}

}  // namespace palpate
