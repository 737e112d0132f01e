// A log that is written down while frames are recorded: lines of a file that grows, of standard input, or of
// a UDP port of this machine.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// The letters of a text that files and topics may have: small ones, digits and underscores, for others too;
/// at most 60.
std::string plain_log_name(const std::string& text);

/// A log as somebody names it: FILE, - or udp:PORT, with "NAME=" before it for another name than the file's,
/// stdin or udp.
struct LogName {
  std::string name;  ///< as plain_log_name() has it
  std::string what;
  bool is_file() const { return what != "-" && !what.starts_with("udp:"); }
};
/// Throws Error(Failure::Usage) for an empty one.
LogName log_name(const std::string& given);

struct LogStatus {
  std::string name;
  uint64_t lines = 0;    ///< written to the session in hand
  uint64_t dropped = 0;  ///< longer than kLongestLogLine_B, or refused by the system's queue of the port
  bool ended = false;    ///< no more can come: the end of standard input
  std::string error;     ///< why it is not written any more; empty while it goes on
};

/// The end of a session's file: what waits for the disk.
class LogEnding {
 public:
  /// Hands the file to the disk and closes it, on any thread; the log's status at its end.
  LogStatus close();

 private:
  friend class LogInput;
  std::shared_ptr<class LogFile> file_;
  LogStatus status_;
};

/// Listens on a thread of its own from the start; what comes while no session is written is not kept, except
/// the first line, which may name the columns, and what a file held before.
class LogInput {
 public:
  /// `given`: as log_name() takes it. Throws Error(Failure::Usage) for what is none of these,
  /// Error(Failure::Input) for what cannot be opened.
  explicit LogInput(const std::string& given);
  /// A log of this program's own, of lines that add() gives. `name`: plain_log_name() of it is the log's.
  static std::unique_ptr<LogInput> of_program(const std::string& name);
  ~LogInput();
  LogInput(const LogInput&) = delete;
  LogInput& operator=(const LogInput&) = delete;

  const std::string& name() const;
  uint16_t port() const;  ///< of UDP: the one that the system chose for "udp:0"; else 0

  /// Begins to write NAME.lines into this folder, which it makes; the file before is closed. Throws
  /// Error(Failure::Output).
  void write_to(const std::filesystem::path& folder);
  /// A line of this program, without its end; any thread.
  void add(std::string_view line);
  /// Takes what is there to be read; what comes from now on is not of the session. Does not wait for the
  /// disk. Nothing happens where no file is open.
  LogEnding end();
  /// The same, and the disk has it.
  LogStatus finish() { return end().close(); }
  LogStatus status() const;

 private:
  LogInput();
  void start();

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The logs of a recording: of others, and of this program from their first line on. Any thread.
class LogSet {
 public:
  void take(std::vector<std::unique_ptr<LogInput>> logs);
  /// A line of a log of this program.
  void add(const std::string& name, std::string_view line);
  /// Begins to write all into this folder. Throws Error(Failure::Output).
  void write_to(const std::filesystem::path& folder);
  /// Ends that, as LogInput has it.
  std::vector<LogEnding> end();

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<LogInput>> logs_;
  std::filesystem::path folder_;  ///< empty: nothing is written
};

/// Closes each; one line of each loss.
std::vector<std::string> close_logs(std::vector<LogEnding>& endings);

/// Opens each. Throws as LogInput does, also where two have one name, or both are standard input.
std::vector<std::unique_ptr<LogInput>> open_logs(const std::vector<std::string>& given);

}  // namespace palpate
