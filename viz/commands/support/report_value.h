// Report: the result of a command, and the exit codes without a Failure of their own.
#pragma once

#include <functional>
#include <string>

namespace palpate {

/// Exit code of a run that Ctrl-C ended, as shells have it.
inline constexpr int kInterrupted = 130;
/// Exit code of our own mistakes.
inline constexpr int kInternalError = 1;

/// Result of a command. Exactly one of text and json reaches stdout.
struct Report {
  std::string text;
  std::string json;
  int exit_code = 0;
};
using Command = std::function<Report()>;

}  // namespace palpate
