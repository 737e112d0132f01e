// The logs of a session: its folder `log` with NAME.lines as they came, and NAME.csv and NAME.json of their
// rows at the frames' times.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/log/log_clock.h"
#include "capture/log/log_table.h"

namespace palpate {

/// Folder in a session.
inline constexpr const char* kLogFolder = "log";

/// A log whose rows have the times of a recording's frames.
struct AlignedLog {
  LogTable table;
  LogClock clock;
  std::vector<double> time_s;  ///< of each row, rising, as measurements.csv counts

  /// A column at a time, straight between rows: none outside of them, and none between rows that are further
  /// apart than five usual intervals and 20 ms. Angles that pass a half turn between two rows take the nearer
  /// row's.
  std::optional<double> at(const LogColumn& column, double time_s) const;

 private:
  friend AlignedLog align_log(LogTable table, const FrameClock& frames, std::optional<double> told_offset_s);
  double widest_gap_s_ = 0;
};

/// Rows more than a second before or after the recording are left out. Throws as find_log_clock does.
AlignedLog align_log(LogTable table, const FrameClock& frames,
                     std::optional<double> told_offset_s = std::nullopt);

/// The first two of these that are known in more than half of the frames.
std::vector<FrameClock::Signal> strongest_signals(std::vector<FrameClock::Signal> signals);

/// The clock of a session's frames, and what was measured of them, by its frames.csv and session.json.
/// Throws Error(Failure::Input).
FrameClock session_clock(const std::filesystem::path& session);

/// Gives the clock of a folder's frames.
using FindClock = std::function<FrameClock(const std::filesystem::path& folder)>;

/// All logs of a session; none where it has none. One that cannot be read or aligned is left out, with a line
/// in `problems` that says why.
std::vector<AlignedLog> session_logs(const std::filesystem::path& session, std::vector<std::string>& problems,
                                     const FindClock& clock = session_clock);

/// Writes NAME.csv (time_s, then the columns) and NAME.json (how it was aligned) beside each NAME.lines. A
/// line of each log for people: rows, columns, alignment, notes, or why there is none. Never throws.
std::vector<std::string> finish_session_logs(const std::filesystem::path& session,
                                             const FindClock& clock = session_clock);

/// NAME.csv of a log with one row a frame: frame, time_s, and the columns at its time, empty where the log
/// does not say. Throws Error(Failure::Output).
void write_log_at_frames(const std::filesystem::path& file, const AlignedLog& log,
                         std::span<const uint64_t> frames, std::span<const double> time_s);

/// "robot: 1200 rows of 7 columns at 100 Hz, aligned by the date, to 0.1 ms", with the notes.
std::string describe(const AlignedLog& log);

}  // namespace palpate
