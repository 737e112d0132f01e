// Report: the result of a command, and the exit codes without a Failure of their own.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "engine/base/facts.h"

namespace palpate {

/// Exit code of a run that Ctrl-C ended, as shells have it.
inline constexpr int kInterrupted = 130;
/// Exit code of our own mistakes.
inline constexpr int kInternalError = 1;

/// Result of a command. Exactly one of text and json reaches stdout.
struct Report : Facts {
  Report() = default;
  Report(Facts facts, int code = 0) : Facts(std::move(facts)), exit_code(code) {}
  Report(std::string words, json::Value value, int code = 0)
      : Facts{std::move(words), std::move(value)}, exit_code(code) {}

  int exit_code = 0;
};
/// Of a run that Ctrl-C ended before it had a result.
inline Report interrupted_report(std::string text = {}) {
  return {std::move(text), json::Value{{"complete", false}}, kInterrupted};
}
using Command = std::function<Report()>;

}  // namespace palpate
