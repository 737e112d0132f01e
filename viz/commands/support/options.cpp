#include "viz/commands/support/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <sstream>

#include "engine/base/text.h"
#include "viz/commands/support/help_text.h"

namespace palpate {
namespace {

constexpr const char* kDefaultGroup = "Options";

/// The unit that an option's name ends in, as the name of its value: "--ball-mm" takes MM.
std::string unit_of(const std::string& name) {
  constexpr std::pair<const char*, const char*> kUnits[] = {{"-mm", "MM"},   {"-nm", "NM"},   {"-deg", "DEG"},
                                                            {"-Pa", "PA"},   {"-kPa", "KPA"}, {"-MPa", "MPA"},
                                                            {"-N", "NEWTON"}};
  for (const auto& [ending, unit] : kUnits)
    if (name.ends_with(ending)) return unit;
  return {};
}

/// Name of an option's value where it has no other: its unit, or its kind; as often as it is
/// wanted.
std::string value_name(const CLI::Option& option, bool path, bool has_choices) {
  std::string name = unit_of(option.get_name());
  const std::string type = option.get_type_name();
  if (name.empty() && path) name = "FILE";
  if (name.empty() && has_choices) name = "NAME";
  if (name.empty() && (type.starts_with("INT") || type.starts_with("UINT"))) name = "N";
  if (name.empty() && type.starts_with("FLOAT")) name = "NUM";
  if (name.empty()) name = "TEXT";
  if (option.get_delimiter() != '\0') return name + option.get_delimiter() + "...";
  constexpr int kMostNamed = 3;
  const int least = option.get_items_expected_min(), most = option.get_items_expected_max();
  if (least == most && most > 1 && most <= kMostNamed) {
    std::string names = name;
    for (int i = 1; i < most; ++i) names += " " + name;
    return names;
  }
  return most > 1 ? name + " ..." : name;
}

/// "--frames: wanted a whole number; found 'x'" of what the library says of a text that is no such value.
std::string unreadable(const CLI::App& app, const std::string& said) {
  const std::string start = "Could not convert: ", equals = " = ";
  const size_t middle = said.find(equals);
  if (!said.starts_with(start) || middle == std::string::npos) return said;
  const std::string name = said.substr(start.size(), middle - start.size());
  const CLI::Option* option = app.get_option_no_throw(name);
  const std::string type = option ? option->get_type_name() : "";
  const std::string kind = type.starts_with("UINT")    ? "a whole number of at least 0"
                           : type.starts_with("INT")   ? "a whole number"
                           : type.starts_with("FLOAT") ? "a number"
                                                       : "another value";
  return name + ": wanted " + kind + "; found '" + said.substr(middle + equals.size()) + "'";
}

/// "--frames: wanted a value; found none" of "--frames: 1 required UINT missing", and "--cells: wanted 3
/// values; found 2" of "--cells: At least 3 required but received 2".
std::string without_value(const std::string& said) {
  const std::string least = ": At least ", received = " required but received ";
  if (const size_t at = said.find(least), then = said.find(received);
      at != std::string::npos && then != std::string::npos) {
    const size_t from = at + least.size();
    return said.substr(0, at) + ": wanted " + said.substr(from, then - from) + " values; found " +
           said.substr(then + received.size());
  }
  const size_t colon = said.find(": "), count = said.find(" required ");
  if (colon == std::string::npos || count == std::string::npos || !said.ends_with(" missing")) return said;
  const std::string number = said.substr(colon + 2, count - colon - 2);
  return said.substr(0, colon) + ": wanted " + (number == "1" ? "a value" : number + " values more") +
         "; found none";
}

/// The error in plain words, where the library has its own way with them.
std::string plain_words(const CLI::App& app, const CLI::ParseError& error) {
  std::string said = error.what();
  if (dynamic_cast<const CLI::ConversionError*>(&error)) return unreadable(app, said);
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error)) return without_value(said);
  const std::string excludes = " excludes ";
  if (const size_t at = said.find(excludes);
      dynamic_cast<const CLI::ExcludesError*>(&error) && at != std::string::npos)
    return said.substr(0, at) + " and " + said.substr(at + excludes.size()) + " exclude each other";
  return said;
}

HelpOption help_of(const CLI::Option& option) {
  HelpOption help{option.get_positional() ? option.get_name() : option.get_name(false, true), ""};
  // A flag that turns something off is named with the value that it gives.
  help.names = help.names.substr(0, help.names.find('{'));
  // An option's text is the name of its value, whether it is required, and its default.
  const std::string& text = option.get_option_text();
  const size_t more = std::min(text.find(" ("), text.find(" ["));
  const bool named = !text.empty() && text.front() != '(' && text.front() != '[';
  if (named) help.names += " " + text.substr(0, more);
  help.about = option.get_description();
  const std::string rest = !named ? text : more == std::string::npos ? "" : text.substr(more + 1);
  if (!rest.empty() && rest != "(required)") help.about += " " + rest;
  return help;
}

void split_footer(const std::string& footer, Help& help) {
  std::istringstream stream(footer);
  for (std::string line; std::getline(stream, line);) {
    if (line == "Examples:") continue;
    if (line.starts_with("  ") && help.notes.find_first_not_of('\n') == std::string::npos)
      help.examples += line + "\n";
    else
      help.notes += line + "\n";
  }
  const size_t start = help.notes.find_first_not_of('\n');
  help.notes.erase(0, start == std::string::npos ? help.notes.size() : start);
}

Help help_of(const CLI::App& app, const std::string& name) {
  Help help;
  help.command = name.empty() ? app.get_name() : name;
  help.about = app.get_description();
  if (const std::string own = app.get_name() + ": "; help.about.starts_with(own))
    help.about.erase(0, own.size());
  std::string required;
  for (const CLI::Option* option : app.get_options(nullptr)) {
    if (option->get_group().empty()) continue;
    const HelpOption one = help_of(*option);
    if (option->get_positional()) {
      help.usage += option->get_required() ? " " + one.names : " [" + one.names + "]";
      help.positional.push_back(one);
      continue;
    }
    if (option->get_required()) required += " " + one.names;
    const std::string group = option->get_group() == kDefaultGroup ? "" : option->get_group();
    const auto there = std::ranges::find(help.groups, group, &HelpGroup::name);
    (there == help.groups.end() ? help.groups.emplace_back(HelpGroup{group, {}}) : *there)
        .options.push_back(one);
  }
  for (const CLI::App* command : app.get_subcommands(nullptr))
    help.commands.push_back({command->get_name(), command->get_description()});
  if (!help.commands.empty()) help.usage += " COMMAND";
  help.usage += required + " [options]";
  // The main options first, those of every command last.
  std::ranges::stable_sort(help.groups, {}, [](const HelpGroup& group) {
    return group.name.empty() ? 0 : group.name == kCommonGroup ? 2 : 1;
  });
  split_footer(app.get_footer(), help);
  return help;
}

std::string formatted(const CLI::App* app, const std::string& name, CLI::AppFormatMode mode) {
  const Help help = help_of(*app, name);
  return mode == CLI::AppFormatMode::All ? whole_help(help) : short_help(help);
}

void add_help_flags(CLI::App& app) {
  app.set_help_flag("-h,--help", "Short help")->group(kCommonGroup);
  app.set_help_all_flag("--help-all", "All options in full, with notes")->group(kCommonGroup);
}

/// The command that was asked for, as far down as it is known.
const CLI::App& deepest(const CLI::App& program) {
  const CLI::App* app = &program;
  while (!app->get_subcommands().empty()) app = app->get_subcommands().front();
  return *app;
}

std::vector<std::string> names_of_options(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* one = &app; one; one = one->get_fallthrough() ? one->get_parent() : nullptr)
    for (const CLI::Option* option : one->get_options(nullptr))
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<std::string> names_of_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) names.push_back(command->get_name());
  return names;
}

/// Error of a word that no command took.
std::string unexpected(const std::string& word, const CLI::App& program) {
  const CLI::App& app = deepest(program);
  if (word.size() > 1 && word.front() == '-') {
    const std::string name = word.substr(0, word.find('='));
    return "there is no option '" + name + "'" + did_you_mean(name, names_of_options(app));
  }
  const std::vector<std::string> commands = names_of_commands(app);
  if (commands.empty()) return "'" + word + "' was not expected: one input, or an option's value, too many";
  const std::string of = &app == &program ? "" : app.get_name() + " ";
  return "there is no command '" + of + word + "'" + did_you_mean(word, commands);
}

}  // namespace

CommandOption* CommandOption::required() {
  option_->required();
  return this;
}
CommandOption* CommandOption::capture_default_str() {
  option_->capture_default_str();
  return this;
}
CommandOption* CommandOption::take_all() {
  option_->take_all();
  return this;
}
CommandOption* CommandOption::description(const std::string& text) {
  option_->description(text);
  return this;
}
CommandOption* CommandOption::default_str(const std::string& text) {
  option_->default_str(text);
  return this;
}
CommandOption* CommandOption::option_text(const std::string& text) {
  option_->option_text(text);
  return this;
}
CommandOption* CommandOption::group(const std::string& name) {
  option_->group(name);
  return this;
}
CommandOption* CommandOption::check(const Check& check) {
  option_->check(check.validator());
  if (!check.choices().empty()) choices_ = check.choices();
  return this;
}
CommandOption* CommandOption::transform(const Check& check) {
  option_->transform(check.validator());
  if (!check.choices().empty()) choices_ = check.choices();
  return this;
}
CommandOption* CommandOption::delimiter(char mark) {
  option_->delimiter(mark);
  return this;
}
CommandOption* CommandOption::expected(int count) {
  option_->expected(count);
  return this;
}
CommandOption* CommandOption::expected(int least, int most) {
  option_->expected(least, most);
  return this;
}
CommandOption* CommandOption::excludes(CommandOption* other) {
  option_->excludes(other->option_);
  return this;
}
CommandOption* CommandOption::needs(CommandOption* other) {
  option_->needs(other->option_);
  return this;
}
CommandOption* CommandOption::takes_path() {
  path_ = true;
  return this;
}
size_t CommandOption::count() const {
  return option_->count();
}

CommandLine::CommandLine(const std::string& description, const std::string& name)
    : own_(std::make_unique<CLI::App>(description, name)), app_(own_.get()) {
  app_->formatter_fn(formatted);
  add_help_flags(*app_);
}

CommandLine::CommandLine(CLI::App* app) : app_(app) {}

CommandLine::~CommandLine() = default;

CommandLine* CommandLine::add_subcommand(const std::string& name, const std::string& description) {
  CLI::App* app = app_->add_subcommand(name, description);
  add_help_flags(*app);
  CommandLine* command = below_.emplace_back(new CommandLine(app)).get();
  command->above_ = this;
  return command;
}
CommandLine* CommandLine::require_subcommand(int count) {
  app_->require_subcommand(count);
  return this;
}
CommandLine* CommandLine::require_subcommand(int least, int most) {
  app_->require_subcommand(static_cast<size_t>(least), static_cast<size_t>(most));
  return this;
}
CommandLine* CommandLine::fallthrough() {
  app_->fallthrough();
  return this;
}
CommandLine* CommandLine::footer(const std::string& text) {
  app_->footer(text);
  return this;
}
CommandLine* CommandLine::callback(std::function<void()> action) {
  app_->callback(std::move(action));
  return this;
}
CommandLine* CommandLine::description(const std::string& text) {
  app_->description(text);
  return this;
}
void CommandLine::set_version_flag(const std::string& name, const std::string& text) {
  app_->set_version_flag(name, text)->group(kCommonGroup);
}

CommandOption* CommandLine::keep(CLI::Option* option) {
  auto& kept = options_[option];
  if (!kept) kept = std::make_unique<CommandOption>(option);
  return kept.get();
}

template <typename Value>
CommandOption* CommandLine::add_plain(const std::string& name, Value& value, const std::string& description) {
  CommandOption* option = keep(app_->add_option(name, value, description));
  // The library takes -1 for the largest number there is.
  if constexpr (std::is_same_v<Value, uint32_t> || std::is_same_v<Value, uint64_t> ||
                std::is_same_v<Value, std::vector<uint32_t>> ||
                std::is_same_v<Value, std::vector<uint64_t>> ||
                std::is_same_v<Value, std::optional<uint64_t>>)
    option->check(Check(CLI::Validator(
        [](std::string& text) {
          return text.starts_with('-') ? "wanted a whole number of at least 0; found " + text : std::string();
        },
        "")));
  using Path = std::filesystem::path;
  if constexpr (std::is_same_v<Value, Path> || std::is_same_v<Value, std::vector<Path>>) option->takes_path();
  return option;
}

#define PALPATE_PLAIN(TYPE) /* NOLINTNEXTLINE(bugprone-macro-parentheses): a type takes none */ \
  template CommandOption* CommandLine::add_plain(const std::string&, TYPE&, const std::string&)
PALPATE_PLAIN(int);
PALPATE_PLAIN(uint32_t);
PALPATE_PLAIN(uint64_t);
PALPATE_PLAIN(float);
PALPATE_PLAIN(double);
PALPATE_PLAIN(std::string);
PALPATE_PLAIN(std::filesystem::path);
PALPATE_PLAIN(std::vector<int>);
PALPATE_PLAIN(std::vector<uint32_t>);
PALPATE_PLAIN(std::vector<uint64_t>);
PALPATE_PLAIN(std::vector<double>);
PALPATE_PLAIN(std::vector<std::string>);
PALPATE_PLAIN(std::vector<std::filesystem::path>);
using Pair = std::array<double, 2>;
PALPATE_PLAIN(Pair);
PALPATE_PLAIN(std::optional<int>);
PALPATE_PLAIN(std::optional<uint64_t>);
PALPATE_PLAIN(std::optional<double>);
PALPATE_PLAIN(std::optional<std::string>);
#undef PALPATE_PLAIN

CommandOption* CommandLine::add_texts(const std::string& name, bool takes_many,
                                      const std::string& description,
                                      std::function<bool(const std::vector<std::string>&)> take,
                                      std::function<std::string()> now) {
  CLI::Option* option = app_->add_option(name, std::move(take), description, false, std::move(now));
  option->type_name("ENUM");
  option->type_size(1, 1);
  option->expected(takes_many ? CLI::detail::expected_max_vector_size : 1);
  option->run_callback_for_default();
  return keep(option);
}

const CommandOption* CommandLine::kept(const CLI::Option* option) const {
  const auto there = options_.find(option);
  return there == options_.end() ? nullptr : there->second.get();
}

CommandOption* CommandLine::add_flag(const std::string& name, bool& value, const std::string& description) {
  return keep(app_->add_flag(name, value, description));
}

CommandOption* CommandLine::add_option_function(const std::string& name,
                                                std::function<void(const std::string&)> take,
                                                const std::string& description) {
  const auto given = [take = std::move(take)](const std::string& text) { take(text); };
  return keep(app_->add_option_function<std::string>(name, given, description));
}

CommandOption* CommandLine::get_option(const std::string& name) {
  CLI::Option* option = app_->get_option_no_throw(name);
  return option ? keep(option) : nullptr;
}

bool CommandLine::parsed() const {
  return app_->parsed();
}

Parsed CommandLine::read(const std::function<void()>& parse) {
  Parsed parsed;
  try {
    parse();
  } catch (const CLI::ParseError& error) {
    parsed.done = false;
    parsed.help = error.get_exit_code() == 0;
    std::ostringstream text;
    if (parsed.help) app_->exit(error, text, text);
    parsed.text = parsed.help ? text.str() : plain_words(deepest(*app_), error);
    // An unexpected word explains more than what is missing because of it, or than the help above it.
    const bool words = parsed.help || dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr ||
                       dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
    if (const std::vector<std::string> left = app_->remaining(true); words && !left.empty()) {
      parsed.help = false;
      parsed.text = unexpected(left.front(), *app_);
    }
  }
  for (auto commands = app_->get_subcommands(); !commands.empty();
       commands = commands.front()->get_subcommands())
    parsed.commands.push_back(commands.front()->get_name());
  return parsed;
}

Parsed CommandLine::parse(const std::vector<std::string>& arguments) {
  return read([&] { app_->parse(std::vector<std::string>(arguments.rbegin(), arguments.rend())); });
}

Parsed CommandLine::parse(int argc, const char* const* argv) {
  return read([&] { app_->parse(argc, argv); });
}

std::optional<int> CommandLine::parse_or_exit(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_->exit(error);
  }
  return std::nullopt;
}

void CommandLine::name_values(const std::pair<const char*, const char*>* names, size_t count) {
  for (CLI::Option* option : app_->get_options(nullptr)) {
    const bool flag = option->get_items_expected_max() == 0;
    if (flag || !option->get_option_text().empty()) continue;
    std::string text;
    for (size_t i = 0; i < count; ++i)
      if (option->get_name() == names[i].first) text = names[i].second;
    if (text.empty() && !option->get_positional()) {
      const CommandOption* own = kept(option);
      text = value_name(*option, own && own->is_path(), own && !own->choices().empty());
    }
    if (option->get_required()) text += text.empty() ? "(required)" : " (required)";
    if (!option->get_default_str().empty()) text += " [" + option->get_default_str() + "]";
    if (!text.empty()) option->option_text(text);
  }
}

}  // namespace palpate
