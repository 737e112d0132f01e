// The program: one command line in, one report out, every failure one line and a documented exit code.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "engine/base/json.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/options.h"
#include "viz/commands/progress.h"
#include "viz/render/window.h"

namespace {

using namespace palpate;

/// Third parties log where they like; ours is the only voice, and stdout belongs to the result.
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

void print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  if (!text.empty() && text.back() != '\n') std::fputc('\n', stdout);
  if (std::fflush(stdout) != 0 || std::ferror(stdout)) {
    throw Error(Failure::Output, "to write to stdout", std::strerror(errno), "another place for the output");
  }
}

/// One line on stderr whatever the message holds; with --json the same as a value on stdout.
int fail(const std::string& message, int exit_code, bool json) {
  std::string line = message;
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "palpate: %s\n", line.c_str());
  if (json) {
    const json::Value value = {{"complete", false}, {"exit_code", exit_code}, {"error", line}};
    std::fputs((value.dump(2, json::Utf8::Replace) + "\n").c_str(), stdout);
    std::fflush(stdout);
  }
  return exit_code;
}

/// In the order of the help.
constexpr void (*kCommands[])(CommandLine& program, Common& common, Command& chosen) = {
    add_live,    add_record,  add_replay,  add_process,   add_export,  add_simulate, add_integrate,
    add_devices, add_cameras, add_demo,    add_calibrate, add_profile, add_tune,     add_optics,
    add_strain,  add_contact, add_modulus, add_forward,   add_lump,    add_match};

int run(int argc, char** argv) {
  CommandLine program("palpate: a camera behind a silicone pad as a calibrated touch instrument.", "palpate");
  program.set_version_flag("--version", std::string("palpate ") + PALPATE_VERSION);
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
      "  palpate COMMAND --help                options and examples of one command\n");
  Common common;
  Command chosen;
  for (const auto add : kCommands) add(program, common, chosen);

  const bool json_asked =
      std::any_of(argv + 1, argv + argc, [](const char* a) { return std::strcmp(a, "--json") == 0; });
  const Parsed parsed = program.parse(argc, argv);
  if (parsed.help) {
    print(parsed.text);
    return 0;
  }
  if (!parsed.done) {
    const auto usage = static_cast<int>(Failure::Usage);
    if (argc > 1 && argv[1][0] != '-' && !program.has_command(argv[1]))
      return fail(std::string("there is no command '") + argv[1] + "'; try: palpate --help", usage,
                  json_asked);
    if (argc == 1)
      return fail("no command was given, and the list of sources wants a window: " + viz::no_display() +
                      "; try: palpate --help, or palpate demo --headless",
                  usage, json_asked);
    std::string command;
    for (const std::string& name : parsed.commands) command += " " + name;
    return fail(parsed.text + "; try: palpate" + command + " --help", usage, json_asked);
  }
  if (start) chosen = start_command(common);
  if (common.quiet) spdlog::set_level(spdlog::level::err);
  catch_interrupts();
  const Report report = chosen();
  print(common.json ? report.json : report.text);
  return report.exit_code;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): what reporting an error throws may end the program
int main(int argc, char** argv) {
  quieten_libraries();
  const bool json =
      std::any_of(argv + 1, argv + argc, [](const char* a) { return std::strcmp(a, "--json") == 0; });
  try {
    start_log();
    return run(argc, argv);
  } catch (const Error& error) {
    return fail(error.what(), error.exit_code(), json);
  } catch (const std::bad_alloc&) {
    return fail("wanted more memory than there is; try smaller frames or fewer outputs", kInternalError,
                json);
  } catch (const std::exception& error) {
    return fail(std::string("internal error: ") + error.what(), kInternalError, json);
  }
}
