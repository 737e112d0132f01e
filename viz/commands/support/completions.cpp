// Completion of a command line that is being typed, from the commands and options themselves.
#include <CLI/CLI.hpp>
#include <algorithm>

#include "viz/commands/support/options.h"

namespace palpate {
namespace {

bool takes_value(const CLI::Option& option) {
  return option.get_items_expected_max() > 0;
}

/// "FILE" of the text "FILE (required) [pad.json]".
std::string value_name(const CLI::Option& option) {
  if (option.get_positional()) return option.get_name();
  const std::string text = option.get_option_text();
  if (text.empty() || text.front() == '(' || text.front() == '[') return {};
  return text.substr(0, std::min(text.find(" ("), text.find(" [")));
}

void add(const std::string& word, const std::string& about, const std::string& typed, Completions& to) {
  if (word.starts_with(typed)) to.words.push_back({to.prefix + word, about.substr(0, about.find('\n'))});
}

}  // namespace

void CommandLine::complete_value(const CLI::Option& option, const std::string& typed, Completions& to) const {
  to.value = value_name(option);
  std::string begun = typed;
  if (const char mark = option.get_delimiter(); mark != '\0' && begun.find(mark) != std::string::npos) {
    const size_t part = begun.rfind(mark) + 1;
    to.prefix += begun.substr(0, part);
    begun.erase(0, part);
  }
  const CommandOption* own = kept(&option);
  if (!own) return;
  to.path = own->is_path();
  for (const std::string& choice : own->choices()) add(choice, "", begun, to);
}

Completions CommandLine::complete(const std::vector<std::string>& words) const {
  Completions found;
  if (words.empty()) return found;
  const CommandLine* at = this;
  const CLI::Option* open = nullptr;  // an option that still takes values
  const CommandLine* owner = nullptr;
  int taken = 0;
  size_t positionals = 0;
  const auto option_of = [&](const std::string& name) {
    for (owner = at; owner; owner = owner->app_->get_fallthrough() ? owner->above_ : nullptr)
      if (const CLI::Option* option = owner->app_->get_option_no_throw(name)) return option;
    return static_cast<const CLI::Option*>(nullptr);
  };
  const bool help = words.size() > 1 && words.front() == "help";
  for (size_t i = help ? 1 : 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    if (word.starts_with('-') && word.size() > 1) {
      open = word.find('=') == std::string::npos ? option_of(word) : nullptr;
      if (open && !takes_value(*open)) open = nullptr;
      taken = 0;
      continue;
    }
    if (open) {
      if (++taken >= open->get_items_expected_max()) open = nullptr;
      continue;
    }
    const auto below =
        std::ranges::find_if(at->below_, [&](const auto& one) { return one->app_->get_name() == word; });
    if (below == at->below_.end())
      ++positionals;
    else
      at = below->get();
  }

  const std::string& typed = words.back();
  if (typed.starts_with('-') && !help) {
    if (const size_t equal = typed.find('='); equal != std::string::npos) {
      const CLI::Option* option = option_of(typed.substr(0, equal));
      found.prefix = typed.substr(0, equal + 1);
      if (option && takes_value(*option)) owner->complete_value(*option, typed.substr(equal + 1), found);
      return found;
    }
    for (const CommandLine* one = at; one; one = one->app_->get_fallthrough() ? one->above_ : nullptr)
      for (const CLI::Option* option : one->app_->get_options(nullptr))
        for (const std::string& name : option->get_lnames())
          add("--" + name, option->get_description(), typed, found);
    return found;
  }
  if (open) {
    owner->complete_value(*open, typed, found);
    return found;
  }
  for (const auto& command : at->below_)
    add(command->app_->get_name(), command->app_->get_description(), typed, found);
  if (at == this && !help) add("help", "Options and examples of one command", typed, found);
  if (help) return found;
  for (const CLI::Option* option : at->app_->get_options(nullptr))
    if (option->get_positional() && takes_value(*option) &&
        (positionals == 0 || option->get_items_expected_max() > static_cast<int>(positionals)))
      at->complete_value(*option, typed, found);
  return found;
}

}  // namespace palpate
