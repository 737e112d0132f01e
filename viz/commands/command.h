// Commands: the common options, their device, and the function that adds each to the program.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "viz/commands/support/report_value.h"

namespace palpate {

class CommandLine;
namespace gpu {
class Context;
}

/// Options that every command understands in the same way.
struct Common {
  bool json = false;        ///< one JSON value on stdout instead of text
  bool jsonl = false;       ///< one line of JSON a frame, then one of the summary
  bool quiet = false;       ///< no progress bar, only errors on stderr
  bool validation = false;  ///< run under the Vulkan validation layer; a message makes the run fail
  std::string device;       ///< index or part of a name; empty: the best one
  uint64_t seed = 1;        ///< of everything random
  std::filesystem::path out;
};

/// Adds the common options to a command, and to its footer the exit codes.
void add_common(CommandLine& command, Common& common, const std::string& examples);

/// Adds --jsonl to a command that measures frames.
void add_jsonl(CommandLine& command, Common& common);
/// Writes a line to stdout at once. Throws Error(Failure::Output).
void print_line(const std::string& line);

/// Each adds one command to the program; `chosen` is what to run once the command line is parsed.
void add_devices(CommandLine& program, Common& common, Command& chosen);
void add_cameras(CommandLine& program, Common& common, Command& chosen);
void add_process(CommandLine& program, Common& common, Command& chosen);
void add_export(CommandLine& program, Common& common, Command& chosen);
void add_simulate(CommandLine& program, Common& common, Command& chosen);
void add_integrate(CommandLine& program, Common& common, Command& chosen);
void add_live(CommandLine& program, Common& common, Command& chosen);
void add_record(CommandLine& program, Common& common, Command& chosen);
void add_replay(CommandLine& program, Common& common, Command& chosen);
void add_demo(CommandLine& program, Common& common, Command& chosen);
void add_calibrate(CommandLine& program, Common& common, Command& chosen);
void add_setup(CommandLine& program, Common& common, Command& chosen);
void add_gallery(CommandLine& program, Common& common, Command& chosen);
void add_profile(CommandLine& program, Common& common, Command& chosen);
void add_tune(CommandLine& program, Common& common, Command& chosen);
void add_optics(CommandLine& program, Common& common, Command& chosen);
void add_forward(CommandLine& program, Common& common, Command& chosen);
void add_lump(CommandLine& program, Common& common, Command& chosen);
void add_contact(CommandLine& program, Common& common, Command& chosen);
void add_strain(CommandLine& program, Common& common, Command& chosen);
void add_match(CommandLine& program, Common& common, Command& chosen);
void add_wrench(CommandLine& program, Common& common, Command& chosen);
void add_modulus(CommandLine& program, Common& common, Command& chosen);
void add_completion(CommandLine& program, Common& common, Command& chosen);
/// How a command line that is being typed may go on: a line "WORD<tab>about" each, and ":files" or ":folders"
/// where such names may follow.
std::string completions(const CommandLine& program, const std::vector<std::string>& words);
/// The list of sources in a window: what the program does without a command, where there is a display.
Command start_command(Common& common);

/// The Vulkan device that the options ask for. Throws Error(Failure::Device).
/// `window_extensions`: for a window, what it needs.
std::unique_ptr<gpu::Context> open_device(const Common& common,
                                          const std::vector<const char*>* window_extensions = nullptr);
/// Logs what the validation layer said; true if it said nothing.
bool validation_clean(const gpu::Context& context);

}  // namespace palpate
