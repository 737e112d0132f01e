#include "viz/commands/option_groups/run_options.h"

#include <string>
#include <variant>

#include "viz/commands/support/options.h"

namespace palpate {
namespace {

/// One member of the settings as an option of its type.
struct Adder {
  CommandLine& command;
  RunSettings& settings;
  const Setting& setting;
  const char* sentence;

  template <typename Value>
  CommandOption* plain(Value& value) const {
    return command.add_option(setting.option, value, sentence);
  }
  void operator()(bool RunSettings::*member) const {
    command.add_flag(setting.option, settings.*member, sentence);
  }
  void operator()(uint64_t RunSettings::*member) const {
    plain(settings.*member)
        ->check(Check::range(static_cast<uint64_t>(setting.least), std::numeric_limits<uint64_t>::max()));
  }
  void operator()(double RunSettings::*member) const {
    CommandOption* option = plain(settings.*member);
    if (setting.most < std::numeric_limits<double>::infinity())
      option->capture_default_str()->check(Check::range(setting.least, setting.most));
    else
      option->check(setting.least_is_out ? Check::positive() : Check::non_negative());
  }
  void operator()(std::filesystem::path RunSettings::*member) const {
    CommandOption* option = plain(settings.*member);
    if (member == &RunSettings::background) option->check(Check::existing_file());
  }
  void operator()(std::vector<Output> RunSettings::*member) const {
    plain(settings.*member)->delimiter(',')->transform(one_of(kOutputNames));
  }
  void operator()(std::vector<std::string> RunSettings::*member) const { plain(settings.*member); }
  void operator()(std::optional<SurfaceSolver> RunSettings::*member) const {
    plain(settings.*member)->transform(one_of(kSolverNames));
  }
};

}  // namespace

void add_settings(CommandLine& command, RunSettings& settings, std::initializer_list<WantedSetting> wanted) {
  for (const WantedSetting& one : wanted) {
    const Setting& setting = run_setting(one.name);
    const char* sentence = one.sentence ? one.sentence : setting.sentence;
    std::visit(Adder{command, settings, setting, sentence}, setting.member);
  }
}

void add_sequence(CommandLine& command, bool& one_sequence) {
  const Setting& setting = run_setting("sequence");
  command.add_flag(setting.option, one_sequence, setting.sentence);
}

}  // namespace palpate
