// Log of another instrument (a robot's poses, joints and forces): lines of CSV or JSON, read into numbers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "capture/log/stamp_columns.h"

namespace palpate {

struct LogColumn {
  std::string name;  ///< as it stands; parts of nested JSON are joined by points
  std::string unit;  ///< at the name's end ("fz_N", "z [mm]"), where it is one that is known; else empty
  std::vector<double> values{};  ///< of each row; NaN: none
};

/// The numbers of a log, rows in the order of their times.
struct LogTable {
  std::string name;                  ///< of the log, such as robot
  std::vector<LogColumn> columns{};  ///< those of numbers, without the time
  LogStamps stamps = LogStamps::None;
  std::string time_column{};        ///< empty: none
  std::vector<double> stamp_s{};    ///< by the log's own clock; empty with LogStamps::None
  std::vector<double> arrived_s{};  ///< when each line arrived, CLOCK_MONOTONIC; NaN: not known
  /// First rows of the stretches between which the log's own clock was set anew; the first is 0.
  std::vector<size_t> stretches{};
  std::vector<std::string> notes{};  ///< what was left out, one line each

  size_t rows() const { return arrived_s.size(); }
};

/// The rows of these numbers alone, in their order. Stretches stay as they are.
void pick_rows(LogTable& table, const std::vector<size_t>& rows);

/// Reads lines one by one. The first decides: an object of JSON, or the names of a CSV's columns, separated
/// by semicolon, tab or comma. A column of times is `time`, `t`, `timestamp`, `stamp`, `monotonic`, `date` or
/// the like with its unit (`time_s`, "Time [ms]", `stamp_ns`), or `stamp.sec` and `stamp.nanosec`; times of
/// the date need no unit, and neither do those of lines whose arrival is known. Empty lines and those that
/// begin with # are skipped; lines that do not fit are left out, and counted in the notes.
class LogReader {
 public:
  /// `name` of the log; `where` names it in messages.
  LogReader(std::string name, std::string where);
  ~LogReader();

  /// `arrived_ns`: CLOCK_MONOTONIC; 0: not known.
  void add(std::string_view line, int64_t arrived_ns);
  /// The lines read so far, as a table. Throws Error(Failure::Input) where no line fits, more than half of
  /// them do not, no column holds numbers, a column of times has no unit that can be told, or times go back
  /// by more than a second in a log whose lines came at unknown times.
  LogTable take();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Longest line that is read, and most columns.
inline constexpr size_t kLongestLogLine_B = 64 << 10;
inline constexpr size_t kMostLogColumns = 1000;

/// Ending of the files that hold a log as it came: each line behind the time of its arrival (CLOCK_MONOTONIC,
/// ns; 0: not known) and a tab.
inline constexpr const char* kLogLines = ".lines";

/// Reads a log's file, or what kLogLines names. Throws Error(Failure::Input).
LogTable read_log(const std::filesystem::path& file, const std::string& name);

}  // namespace palpate
