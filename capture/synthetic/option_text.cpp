#include "capture/synthetic/option_text.h"

#include <algorithm>
#include <sstream>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {

std::vector<OptionText::Option> OptionText::options_of(const std::string& input) {
  std::vector<Option> out;
  const size_t question = input.find('?');
  std::istringstream pairs(question == std::string::npos ? "" : input.substr(question + 1));
  for (std::string pair; std::getline(pairs, pair, '&');) {
    const size_t equals = pair.find('=');
    out.push_back({pair.substr(0, equals), equals == std::string::npos ? "" : pair.substr(equals + 1)});
  }
  return out;
}

bool OptionText::names(const std::string& input, const std::string& prefix) {
  return input == prefix || input.starts_with(prefix + "?");
}

double OptionText::number(const Option& option, double least, double most) const {
  const auto value = number<double>(option);
  if (!(value >= least && value <= most))
    refuse_number(text("a number of %g to %g", least, most), option.key, option.value);
  return value;
}

std::pair<uint32_t, uint32_t> OptionText::size(const std::string& text) const {
  const size_t cross = text.find('x');
  if (cross == std::string::npos)
    throw Error(Failure::Input, std::string("size=WIDTHxHEIGHT of the ") + what_, "'" + text + "'",
                "size=640x480 or size=1392x1042");
  return {number<uint32_t>("size", text.substr(0, cross)), number<uint32_t>("size", text.substr(cross + 1))};
}

std::string OptionText::one_of(const Option& option, const std::vector<std::string>& words) const {
  if (std::ranges::find(words, option.value) == words.end()) refuse_value(option, words);
  return option.value;
}

void OptionText::refuse(const Option& option) const {
  const std::string pair = option.key + (option.value.empty() ? "" : "=" + option.value);
  throw Error(Failure::Input, std::string("an option of the ") + what_,
              "'" + pair + "'" + did_you_mean(option.key, names_before(keys_, '=')), keys_);
}

void OptionText::refuse_number(const std::string& wanted, const std::string& key,
                               const std::string& text) const {
  throw Error(Failure::Input, wanted + " for '" + key + "' of the " + what_, "'" + text + "'", keys_);
}

void OptionText::refuse_value(const Option& option, const std::vector<std::string>& words) const {
  std::string list;
  for (const std::string& word : words) list += (list.empty() ? "" : ", ") + word;
  throw Error(Failure::Input, "a value for '" + option.key + "' of the " + what_,
              "'" + option.value + "'" + did_you_mean(option.value, words), "one of " + list);
}

}  // namespace palpate
