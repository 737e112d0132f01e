// Logs of other instruments beside the frames of a recording: those of a session, and files that are given.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/log/session_logs.h"
#include "palpate/touch.h"

namespace palpate {

/// Collects the frames of a run; NAME_log.csv has each log's columns at their times.
class LogsBeside {
 public:
  /// `input`: of the run; `files`: given logs, as FILE or NAME=FILE, read at once; `offset_s`: to add to
  /// their times, instead of finding it. Throws Error(Failure::Usage) for what is no file,
  /// Error(Failure::Input) for one that cannot be read.
  LogsBeside(const std::string& input, const std::vector<std::string>& files, std::optional<double> offset_s);

  void add(const Touch& touch);
  /// All logs, aligned with the frames. Throws Error(Failure::Input) where a given one cannot be; `problems`:
  /// a line of each of a session's own that cannot.
  std::vector<AlignedLog> take(std::vector<std::string>& problems);
  /// NAME_log.csv of each. Throws Error(Failure::Output).
  void write(const std::vector<AlignedLog>& logs, const std::filesystem::path& folder) const;

 private:
  FrameClock measured_clock() const;

  std::filesystem::path session_;  ///< empty: the input is none
  std::vector<LogTable> given_;
  std::optional<double> offset_s_;
  std::vector<uint64_t> frames_;
  std::vector<double> time_s_;
  std::vector<double> force_N_, depth_mm_, gray_sum_;  ///< of each frame; NaN: none
};

}  // namespace palpate
