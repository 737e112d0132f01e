// The program: one command line in, one report out, every failure one line and a documented exit code.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "engine/base/json.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/evaluate/evaluate.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/render/desktop.h"

namespace {

using namespace palpate;

/// Silences the logs of libraries: only palpate writes to stderr, and stdout holds the result alone.
void quieten_libraries() {
  setenv("OPENCV_LOG_LEVEL", "SILENT", 0);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
  setenv("OPENCV_VIDEOIO_DEBUG", "0", 0);
  // A full disk or a closed pipe must come back as an error from write, not as a signal.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

void start_log() {
  auto logger = spdlog::stderr_color_mt("palpate");
  logger->set_pattern("palpate: %^%v%$");
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
int fail(const std::string& message, int exit_code, Form form) {
  std::string line = message;
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "palpate: %s\n", line.c_str());
  if (form != Form::Text) {
    const json::Value value = {{"complete", false}, {"exit_code", exit_code}, {"error", line}};
    std::fputs((value.dump(form == Form::Json ? 2 : -1, json::Utf8::Replace) + "\n").c_str(), stdout);
    std::fflush(stdout);
  }
  return exit_code;
}

/// In the order of the help.
constexpr void (*kCommands[])(CommandLine& program, Common& common, Command& chosen) = {
    add_live,    add_record,  add_replay,   add_process,   add_export,    add_simulate, add_integrate,
    add_devices, add_cameras, add_demo,     add_setup,     add_calibrate, add_gallery,  add_profile,
    add_tune,    add_optics,  add_strain,   add_contact,   add_wrench,    add_modulus,  add_forward,
    add_lump,    add_match,   add_evaluate, add_completion};

int run(int argc, char** argv) {
  CommandLine program("a camera behind a silicone pad as a calibrated touch instrument.", "palpate");
  program.set_version_flag("-V,--version", std::string("palpate ") + PALPATE_VERSION);
  // Without a command there is the list of sources, where it can be shown.
  const bool start = argc == 1 && viz::display_available();
  program.require_subcommand(start ? 0 : 1);
  program.footer(
      "Examples:\n"
      "  palpate                               a window with what there is to open: cameras, recordings\n"
      "  palpate demo --out out/demo           measure a simulated palpation, compare with the truth\n"
      "  palpate live                          a simulated palpation, live in a window\n"
      "  palpate record --camera /dev/video0 --sensor my_sensor.json --out out/press\n"
      "  palpate process out/press --out out/measured\n"
      "  palpate help COMMAND                  options and examples of one command\n");
  Common common;
  Command chosen;
  for (const auto add : kCommands) add(program, common, chosen);

  const Form form = form_of(argc, argv);
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() > 1 && words.front() == "complete") {
    print(completions(program, {words.begin() + 1, words.end()}));
    return 0;
  }
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    words.push_back("--help");
  }
  const Parsed parsed = program.parse(words);
  if (parsed.help) {
    print(parsed.text);
    return 0;
  }
  if (!parsed.done) {
    const auto usage = static_cast<int>(Failure::Usage);
    if (argc == 1)
      return fail("no command was given, and the list of sources needs a window: " + viz::desktop_message() +
                      "; try: palpate --help, or palpate demo --headless",
                  usage, form);
    std::string command;
    for (const std::string& name : parsed.commands) command += " " + name;
    return fail(parsed.text + "; try: palpate" + command + " --help", usage, form);
  }
  if (start) chosen = start_command(common);
  if (common.quiet) spdlog::set_level(spdlog::level::err);
  catch_interrupts();
  const Report report = chosen();
  print(common.json    ? report.json
        : common.jsonl ? "{\"summary\":" + json::parse(report.json).dump(-1, json::Utf8::Replace) + "}"
                       : report.text);
  return report.exit_code;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): what reporting an error throws may end the program
int main(int argc, char** argv) {
  quieten_libraries();
  const Form form = form_of(argc, argv);
  try {
    start_log();
    return run(argc, argv);
  } catch (const Error& error) {
    return fail(error.what(), error.exit_code(), form);
  } catch (const std::bad_alloc&) {
    return fail("wanted more memory; found none left; try smaller frames or fewer outputs", kInternalError,
                form);
  } catch (const std::exception& error) {
    return fail(std::string("internal error: ") + error.what(), kInternalError, form);
  }
}
