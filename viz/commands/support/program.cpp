#include "viz/commands/support/program.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <sstream>

#include "engine/base/freed_memory.h"
#include "engine/base/json.h"
#include "palpate/error.h"
#include "palpate/version.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/shell_completion.h"

namespace palpate {
namespace {

/// Silences the logs of libraries: only the program writes to stderr, and stdout holds the result alone.
void quieten_libraries() {
  setenv("OPENCV_LOG_LEVEL", "SILENT", 0);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
  setenv("OPENCV_VIDEOIO_DEBUG", "0", 0);
  // A full disk or a closed pipe must come back as an error from write, not as a signal.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

void start_log(const std::string& name) {
  auto logger = spdlog::stderr_color_mt(name);
  logger->set_pattern(name + ": %^%v%$");
  spdlog::set_default_logger(logger);
}

/// Form of the result on stdout.
enum class Form : uint8_t { Text, Json, JsonLines };

Form form_of(int argc, char** argv) {
  const auto given = [&](const char* flag) {
    return std::any_of(argv + 1, argv + argc, [&](const char* a) { return std::strcmp(a, flag) == 0; });
  };
  return given("--json") ? Form::Json : given("--jsonl") ? Form::JsonLines : Form::Text;
}

void print(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  if (!text.empty()) print_line(text);  // of several processes one has something to say
}

/// One line on stderr whatever the message holds; with --json and --jsonl the same as a value on stdout.
int fail(const Program& program, const std::string& message, int exit_code, Form form) {
  std::string line = message;
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "%s: %s\n", program.name, line.c_str());
  if (form != Form::Text) {
    const json::Value value = {{"complete", false}, {"exit_code", exit_code}, {"error", line}};
    std::fputs((value.dump(form == Form::Json ? 2 : -1, json::Utf8::Replace) + "\n").c_str(), stdout);
    std::fflush(stdout);
  }
  return exit_code;
}

/// True where `words` begin with the words of an old name; an option in it may stand anywhere after them.
bool names(const std::vector<std::string>& words, const std::string& old) {
  std::istringstream parts(old);
  auto at = words.begin();
  for (std::string part; parts >> part; ++at) {
    if (part.starts_with("--"))
      return std::any_of(at, words.end(), [&](const std::string& word) {
        return word == part || word.starts_with(part + "=");
      });
    if (at == words.end() || *at != part) return false;
  }
  return true;
}

const MovedCommand* moved_of(const Program& program, const std::vector<std::string>& words) {
  const auto found =
      std::ranges::find_if(program.moved, [&](const MovedCommand& one) { return names(words, one.old); });
  return found == program.moved.end() ? nullptr : &*found;
}

int run(const Program& what, int argc, char** argv) {
  const std::string name = what.name;
  CommandLine program(what.about, name);
  program.set_version_flag("-V,--version", name + " " PALPATE_VERSION_TEXT);
  const std::string hindrance = argc == 1 && what.no_start ? what.no_start() : std::string();
  const bool start = argc == 1 && what.start && hindrance.empty();
  program.require_subcommand(start ? 0 : 1);
  program.footer(std::string("Examples:\n") + what.examples);
  Common common;
  Command chosen;
  for (const auto add : what.commands) add(program, common, chosen);
  add_completion(program, common, chosen, name);

  const Form form = form_of(argc, argv);
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() > 1 && words.front() == "complete") {
    print(completions(program, {words.begin() + 1, words.end()}));
    return 0;
  }
  const bool help = !words.empty() && words.front() == "help";
  if (help) words.erase(words.begin());
  const auto usage = static_cast<int>(Failure::Usage);
  if (const MovedCommand* moved = moved_of(what, words))
    return fail(what,
                std::string("'") + moved->old + "' is " + moved->now + " now; try: " + moved->now +
                    " --help (Debian: the package palpate-lab)",
                usage, form);
  if (help) words.push_back("--help");
  const Parsed parsed = program.parse(words);
  if (parsed.help) {
    print(parsed.text);
    return 0;
  }
  if (!parsed.done) {
    if (argc == 1 && !hindrance.empty()) return fail(what, hindrance, usage, form);
    std::string command = name;
    for (const std::string& word : parsed.commands) command += " " + word;
    return fail(what, parsed.text + "; try: " + command + " --help", usage, form);
  }
  if (start) chosen = what.start(common);
  if (common.quiet) spdlog::set_level(spdlog::level::err);
  catch_interrupts();
  const Report report = chosen();
  const bool silent = report.json.is_object() && report.json.empty();  // of several processes one reports
  if (!common.json && !common.jsonl)
    print(report.text);
  else if (!silent)
    print(common.json ? report.json.dump(2, json::Utf8::Replace)
                      : json::Value{{"summary", report.json}}.dump(-1, json::Utf8::Replace));
  return report.exit_code;
}

}  // namespace

int run_program(const Program& program, int argc, char** argv) {
  keep_freed_memory();
  quieten_libraries();
  const Form form = form_of(argc, argv);
  try {
    start_log(program.name);
    return run(program, argc, argv);
  } catch (const Error& error) {
    return fail(program, error.what(), error.exit_code(), form);
  } catch (const std::bad_alloc&) {
    return fail(program, "wanted more memory; found none left; try smaller frames or fewer outputs",
                kInternalError, form);
  } catch (const std::exception& error) {
    return fail(program, std::string("internal error: ") + error.what(), kInternalError, form);
  }
}

}  // namespace palpate
