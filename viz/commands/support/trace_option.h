// --trace of commands that measure frames.
#pragma once

#include <filesystem>
#include <optional>

#include "engine/base/trace.h"

namespace palpate {

class CommandLine;

class TraceOption {
 public:
  void add_to(CommandLine& command);
  /// Begins the file that was asked for, if any; it lasts as long as `trace`. Throws Error(Failure::Output).
  void start(std::optional<TraceFile>& trace) const;

 private:
  std::filesystem::path file_;
};

}  // namespace palpate
