// --trace of commands that measure frames.
#pragma once

#include <filesystem>
#include <memory>

#include "engine/base/trace.h"

namespace palpate {

class CommandLine;

class TraceOption {
 public:
  void add_to(CommandLine& command);
  /// Begins the file that was asked for, null where none was; a disk that is full later is a warning. Throws
  /// Error(Failure::Output).
  std::unique_ptr<TraceFile> start() const;

 private:
  std::filesystem::path file_;
};

}  // namespace palpate
