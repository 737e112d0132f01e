// Options that every command has, their device, and what goes to stdout.
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

/// The Vulkan device that the options ask for. Throws Error(Failure::Device).
/// `window_extensions`: for a window, what it needs.
std::unique_ptr<gpu::Context> open_device(const Common& common,
                                          const std::vector<const char*>* window_extensions = nullptr);
/// Logs what the validation layer said; true if it said nothing.
bool validation_clean(const gpu::Context& context);

}  // namespace palpate
