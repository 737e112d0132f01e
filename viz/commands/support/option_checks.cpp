// Checks of options' values, and what they say of a value that breaks them.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <sstream>

#include "engine/base/text.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string refusal_of(const std::string& word, const std::vector<std::string>& words) {
  return "wanted one of " + joined(words) + "; found '" + word + "'" + did_you_mean(word, words);
}

/// A number as a person writes it: "1e-09", "86400".
template <typename Number>
std::string plain(Number value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

/// Refuses numbers that are not `allowed`; other texts are left to the option's own conversion.
template <typename Number>
CLI::Validator number_check(const std::string& wanted, std::function<bool(Number)> allowed) {
  return CLI::Validator(
      [wanted, allowed](std::string& text) {
        Number value{};
        if (!CLI::detail::lexical_cast(text, value)) return "wanted " + wanted + "; found '" + text + "'";
        return allowed(value) ? std::string() : "wanted " + wanted + "; found " + text;
      },
      "");
}

template <typename Number>
CLI::Validator range_check(Number least, Number most) {
  std::string wanted = "a number from " + plain(least) + " to " + plain(most);
  if constexpr (std::is_floating_point_v<Number>) {
    const bool above_0 = least > 0 && least < 1e-300;
    if (above_0) wanted = "a number above 0" + (most < 1e300 ? " and up to " + plain(most) : "");
    if (!above_0 && most > 1e300) wanted = "a number of at least " + plain(least);
  } else if (most == std::numeric_limits<Number>::max()) {
    wanted = "a whole number of at least " + plain(least);
  } else {
    wanted = "a whole number from " + plain(least) + " to " + plain(most);
  }
  return number_check<Number>(wanted,
                              [least, most](Number value) { return value >= least && value <= most; });
}

}  // namespace

Check::Check(CLI::Validator validator)
    : validator_(std::make_shared<const CLI::Validator>(std::move(validator))) {}

Check::Check(CLI::Validator validator, std::vector<std::string> choices)
    : validator_(std::make_shared<const CLI::Validator>(std::move(validator))),
      choices_(std::move(choices)) {}

Check::Check(std::string (*refusal)(const std::string& text))
    : Check(CLI::Validator([refusal](std::string& text) { return refusal(text); }, "")) {}

Check Check::range(int least, int most) {
  return Check(range_check(least, most));
}
Check Check::range(uint64_t least, uint64_t most) {
  return Check(range_check(least, most));
}
Check Check::range(double least, double most) {
  return Check(range_check(least, most));
}
Check Check::positive() {
  return Check(number_check<double>("a number above 0", [](double value) { return value > 0; }));
}
Check Check::non_negative() {
  return Check(number_check<double>("a number of at least 0", [](double value) { return value >= 0; }));
}
Check Check::existing_file() {
  return Check(CLI::ExistingFile);
}
Check Check::one_of(std::initializer_list<const char*> words) {
  return one_of(std::vector<std::string>(words.begin(), words.end()));
}
Check Check::one_of(const std::vector<std::string>& words) {
  return Check(CLI::Validator(
                   [words](std::string& word) {
                     return std::ranges::find(words, word) == words.end() ? refusal_of(word, words)
                                                                          : std::string();
                   },
                   ""),
               words);
}
Check Check::one_of(std::initializer_list<int> numbers) {
  std::vector<std::string> words;
  for (const int number : numbers) words.push_back(std::to_string(number));
  return Check(CLI::IsMember(std::vector<int>(numbers)), std::move(words));
}
Check Check::number_of(const std::map<std::string, int>& names) {
  std::vector<std::string> words;
  for (const auto& [name, value] : names) words.push_back(name);
  return Check(CLI::Validator(
                   [names, words](std::string& word) {
                     const auto there = names.find(CLI::detail::to_lower(word));
                     if (there == names.end()) return refusal_of(word, words);
                     word = std::to_string(there->second);
                     return std::string();
                   },
                   ""),
               words);
}

}  // namespace palpate
