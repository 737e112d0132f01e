// Option text: "synthetic:NAME?key=value&...", and what is said of a bad one.
#pragma once

#include <charconv>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace palpate {

/// Keys of one kind of synthetic input. Its errors are Error(Failure::Input).
class OptionText {
 public:
  struct Option {
    std::string key, value;
  };

  /// `what` takes the options, as "synthetic object"; `keys`: "key=VALUE, key=VALUE, ...".
  constexpr OptionText(const char* what, const char* keys) : what_(what), keys_(keys) {}

  /// Text behind the input's '?'.
  static std::vector<Option> options_of(const std::string& input);
  /// The input is `prefix`, alone or followed by "?...".
  static bool names(const std::string& input, const std::string& prefix);

  template <class Number>
  Number number(const Option& option) const {
    return number<Number>(option.key, option.value);
  }
  double number(const Option& option, double least, double most) const;
  /// "WIDTHxHEIGHT", px.
  std::pair<uint32_t, uint32_t> size(const std::string& text) const;
  template <class Value>
  Value choose(const Option& option, const std::map<std::string, Value>& choices) const {
    const auto found = choices.find(option.value);
    if (found != choices.end()) return found->second;
    std::vector<std::string> names;
    names.reserve(choices.size());
    for (const auto& [name, value] : choices) names.push_back(name);
    refuse_value(option, names);
  }
  std::string one_of(const Option& option, const std::vector<std::string>& words) const;

  /// Throws: the option is none of the keys.
  [[noreturn]] void refuse(const Option& option) const;

 private:
  template <class Number>
  Number number(const std::string& key, const std::string& text) const {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) refuse_number("a number", key, text);
    return value;
  }
  [[noreturn]] void refuse_number(const std::string& wanted, const std::string& key,
                                  const std::string& text) const;
  [[noreturn]] void refuse_value(const Option& option, const std::vector<std::string>& words) const;

  const char *what_, *keys_;
};

}  // namespace palpate
