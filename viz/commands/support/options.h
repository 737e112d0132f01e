// Command line: commands, their options and checks of values. The library behind it is seen by options.cpp,
// option_checks.cpp and completions.cpp alone.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace palpate {

/// Name of the group of options that every command has.
inline constexpr const char* kCommonGroup = "Every command";

/// A rule for an option's value, which help names with it; a value that breaks it is a usage error.
class Check {
 public:
  explicit Check(CLI::Validator validator);
  /// `refusal` says what is wrong with a text, or nothing.
  Check(std::string (*refusal)(const std::string& text));
  const CLI::Validator& validator() const { return *validator_; }
  /// All values that pass, where they can be listed.
  const std::vector<std::string>& choices() const { return choices_; }

  /// From `least` to `most`, both of them included; the type is that of the option's value.
  static Check range(int least, int most);
  static Check range(uint64_t least, uint64_t most);
  static Check range(double least, double most);
  static Check positive();
  static Check non_negative();
  static Check existing_file();
  static Check one_of(std::initializer_list<const char*> words);
  static Check one_of(const std::vector<std::string>& words);
  static Check one_of(std::initializer_list<int> numbers);
  /// Turns a name, in any case, into the text of its number; another word is refused with what there is.
  static Check number_of(const std::map<std::string, int>& names);

 private:
  Check(CLI::Validator validator, std::vector<std::string> choices);

  std::shared_ptr<const CLI::Validator> validator_;
  std::vector<std::string> choices_;
};

/// Turns a name into its value; another word is refused with what there is. For CommandOption::transform of
/// an option that holds a Value (an enum, or several).
template <typename Value>
Check one_of(const std::map<std::string, Value>& names) {
  std::map<std::string, int> numbers;
  for (const auto& [name, value] : names) numbers[name] = static_cast<int>(value);
  return Check::number_of(numbers);
}

/// One option of a command. Every setter returns the option itself.
class CommandOption {
 public:
  explicit CommandOption(CLI::Option* option) : option_(option) {}

  CommandOption* required();
  /// Help shows the value that the variable has now, or the text given.
  CommandOption* capture_default_str();
  /// All values of an option given several times count; otherwise that is an error.
  CommandOption* take_all();
  CommandOption* description(const std::string& text);
  CommandOption* default_str(const std::string& text);
  /// Text that the help shows in place of type, checks and default.
  CommandOption* option_text(const std::string& text);
  CommandOption* group(const std::string& name);
  CommandOption* check(const Check& check);
  /// A check that may change the value's text.
  CommandOption* transform(const Check& check);
  /// Values in one argument, separated by `mark`.
  CommandOption* delimiter(char mark);
  CommandOption* expected(int count);
  CommandOption* expected(int least, int most);
  CommandOption* excludes(CommandOption* other);
  CommandOption* needs(CommandOption* other);
  /// Number of times it was given; after parsing.
  size_t count() const;

  /// Marks the value as a file or folder; options that hold paths are so by themselves.
  CommandOption* takes_path();
  bool is_path() const { return path_; }
  /// All values that it takes, where they can be listed.
  const std::vector<std::string>& choices() const { return choices_; }

 private:
  CLI::Option* option_;
  bool path_ = false;
  std::vector<std::string> choices_;
};

/// Outcome of parsing a command line.
struct Parsed {
  bool done = true;  ///< false: `text` is all there is to say
  bool help =
      false;  ///< `text` is the help or version asked for and belongs to stdout; else an error's reason
  std::string text;
  std::vector<std::string> commands;  ///< the command and what is below it, as far as known
};

/// Possible next words of a command line that is being typed.
struct Completions {
  struct Word {
    std::string word;
    std::string about;
  };
  std::vector<Word> words;
  /// The option's or argument's name of its value ("FILE"), where a value is wanted; its choices are `words`.
  std::string value;
  std::string prefix;  ///< the part of the last word that is before such a value
  bool path = false;   ///< a file or folder is wanted
};

/// A program, or one of its commands.
class CommandLine {
 public:
  /// Command line of a whole program.
  CommandLine(const std::string& description, const std::string& name);
  explicit CommandLine(const std::string& description = "") : CommandLine(description, "") {}
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// The same address for as long as this lives.
  CommandLine* add_subcommand(const std::string& name, const std::string& description);
  /// Exactly `count` of the commands below (0: any number).
  CommandLine* require_subcommand(int count);
  CommandLine* require_subcommand(int least, int most);
  /// Options that a command does not know are taken as its group's.
  CommandLine* fallthrough();
  /// Ends the help: lines that begin with two blanks are examples, one that begins with six continues the
  /// one before; all else are notes.
  CommandLine* footer(const std::string& text);
  CommandLine* callback(std::function<void()> action);
  /// `chosen` becomes `run` where this command is the one that is given.
  template <typename Chosen, typename Run>
  void runs(Chosen& chosen, Run run) {
    callback([&chosen, run] { chosen = run; });
  }
  CommandLine* description(const std::string& text);
  void set_version_flag(const std::string& name, const std::string& text);

  /// `value` takes what is given; it has to live until parsing is over. Defined for bool, int, uint32_t,
  /// uint64_t, float, double, std::string, std::filesystem::path, vectors, pairs (std::array) and
  /// std::optional of them, and for enums, their vectors and std::optional, behind a transform by one_of.
  template <typename Value>
  CommandOption* add_option(const std::string& name, Value& value, const std::string& description = "");
  /// An option whose default help shows and whose value passes `check`.
  template <typename Value>
  CommandOption* add_setting(const std::string& name, Value& value, const Check& check,
                             const std::string& description) {
    return add_option(name, value, description)->capture_default_str()->check(check);
  }
  CommandOption* add_flag(const std::string& name, bool& value, const std::string& description);
  /// The text goes to `take`.
  CommandOption* add_option_function(const std::string& name, std::function<void(const std::string&)> take,
                                     const std::string& description);
  /// An option of this command by its name; null where there is none.
  CommandOption* get_option(const std::string& name);

  bool parsed() const;
  /// Reads the arguments (without the program's name) and calls the callbacks of what was chosen.
  Parsed parse(const std::vector<std::string>& arguments);
  Parsed parse(int argc, const char* const* argv);
  /// For programs without commands: prints help or the error, and returns the exit code to end with.
  std::optional<int> parse_or_exit(int argc, const char* const* argv);

  /// How the last of these words (without the program's name) may go on; words that do not begin so are left
  /// out.
  Completions complete(const std::vector<std::string>& words) const;

  /// Gives every option without a text of its own the name of its value from `names` (option, value name),
  /// and its default.
  void name_values(const std::pair<const char*, const char*>* names, size_t count);

 private:
  explicit CommandLine(CLI::App* app);
  /// An option whose parts are taken as they come; `takes_many`: any number of them.
  CommandOption* add_texts(const std::string& name, bool takes_many, const std::string& description,
                           std::function<bool(const std::vector<std::string>&)> take,
                           std::function<std::string()> now);
  CommandOption* keep(CLI::Option* option);
  const CommandOption* kept(const CLI::Option* option) const;
  void complete_value(const CLI::Option& option, const std::string& typed, Completions& to) const;
  Parsed read(const std::function<void()>& parse);

  std::unique_ptr<CLI::App> own_;
  CLI::App* app_;
  const CommandLine* above_ = nullptr;
  std::vector<std::unique_ptr<CommandLine>> below_;
  std::map<const CLI::Option*, std::unique_ptr<CommandOption>> options_;

  template <typename Value>
  CommandOption* add_plain(const std::string& name, Value& value, const std::string& description);

  template <typename Value>
  struct IsEnums : std::false_type {};
  template <typename Value>
  struct IsEnums<std::vector<Value>> : std::is_enum<Value> {};
  template <typename Value>
  struct IsOptionalEnum : std::false_type {};
  template <typename Value>
  struct IsOptionalEnum<std::optional<Value>> : std::is_enum<Value> {};
};

template <typename Value>
CommandOption* CommandLine::add_option(const std::string& name, Value& value,
                                       const std::string& description) {
  if constexpr (std::is_enum_v<Value>) {
    return add_texts(
        name, false, description,
        [&value](const std::vector<std::string>& texts) {
          value = static_cast<Value>(std::stoi(texts.back()));
          return true;
        },
        [&value] { return std::to_string(static_cast<int>(value)); });
  } else if constexpr (IsOptionalEnum<Value>::value) {
    return add_texts(name, false, description,
                     [&value](const std::vector<std::string>& texts) {
                       value = static_cast<typename Value::value_type>(std::stoi(texts.back()));
                       return true;
                     },
                     {});
  } else if constexpr (IsEnums<Value>::value) {
    return add_texts(name, true, description,
                     [&value](const std::vector<std::string>& texts) {
                       value.clear();
                       for (const std::string& text : texts)
                         value.push_back(static_cast<typename Value::value_type>(std::stoi(text)));
                       return true;
                     },
                     {});
  } else {
    return add_plain(name, value, description);
  }
}

}  // namespace palpate
