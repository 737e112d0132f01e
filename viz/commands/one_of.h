// A command line's word that stands for one of a few values.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace palpate {

/// Turns a name into its value; another word is refused with what there is. For CLI::Option::transform of an
/// option that holds a Value (an enum, or several).
template <typename Value>
CLI::Validator one_of(const std::map<std::string, Value>& names) {
  std::string known;
  for (const auto& [name, value] : names) known += (known.empty() ? "" : ", ") + name;
  return CLI::Validator(
      [names, known](std::string& word) {
        const auto there = names.find(CLI::detail::to_lower(word));
        if (there == names.end()) return "wanted one of " + known + "; found '" + word + "'";
        word = std::to_string(static_cast<int>(there->second));
        return std::string();
      },
      "");
}

}  // namespace palpate
