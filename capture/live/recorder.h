// The record switch of a live session: sessions begin and end while frames go on.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "capture/log/log_input.h"
#include "capture/session/session.h"

namespace palpate {

/// Folder name of a session that begins now, such as session-20170314-151617; with a number behind it where
/// `parent` has one of that name already.
std::filesystem::path new_session_folder(const std::filesystem::path& parent);

class Recording {
 public:
  /// A session that is being written or was.
  struct Written {
    std::filesystem::path folder;
    SessionStatus status;
    std::vector<std::string> logs{};  ///< a line of each log: what came and how it was aligned
  };
  /// `folder`: names the next session's. `info` and `options` are those of every session.
  Recording(std::function<std::filesystem::path()> folder, SessionInfo info, SessionOptions options);
  /// Ends the session in hand and waits until it is written.
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  /// Logs that each session takes with it, in a folder of its own. Before the first start.
  void take(std::vector<std::unique_ptr<LogInput>> logs) { logs_.take(std::move(logs)); }
  /// A line of a log of this program, into the session in hand; any thread. The log begins with its first
  /// line.
  void log(const std::string& name, std::string_view line) { logs_.add(name, line); }
  /// Main thread. Begins a session; throws Error(Failure::Output). The untouched image is that of `info`.
  void start();
  /// Main thread. Ends it; its last frames are written in the background. Does not wait for the disk.
  void stop();
  bool on() const;
  /// A record() that waits for room asks this; true makes it give up. Before the first start.
  void watch(std::function<bool()> cancelled) { cancelled_ = std::move(cancelled); }

  /// Capture's thread. The first frame of a session is marked after_gap, so that what is measured of it
  /// depends on the session alone. False: the session in hand had no room for the frame, which is as it was
  /// and must not be measured either; a session that has failed asks for nothing.
  [[nodiscard]] bool record(Frame& frame);
  /// The engine's thread, rising sequence numbers. `ready_ns`: when the measurement was, CLOCK_MONOTONIC.
  void measured(const Touch& touch, int64_t ready_ns);

  /// Status of the session in hand, else of the last one; any thread.
  Written latest() const;
  /// Ends the session in hand and waits for the disk: all sessions since the last call, in order.
  std::vector<Written> finish();

 private:
  struct Current {
    std::filesystem::path folder;
    std::shared_ptr<SessionWriter> writer;
  };
  std::shared_ptr<SessionWriter> writer() const;

  std::function<std::filesystem::path()> folder_;
  SessionInfo info_;
  SessionOptions options_;
  std::function<bool()> cancelled_;
  mutable std::mutex mutex_;
  std::optional<Current> current_;
  LogSet logs_;
  Current latest_;                            // in hand or over
  std::deque<std::future<Written>> closing_;  ///< oldest first; main thread
  std::vector<Written> written_;              ///< before these
  std::weak_ptr<SessionWriter> recorded_to_;  ///< capture's own: the session that has a frame already
};

/// One line for people: folder, frames, drops, what went wrong.
std::string describe(const Recording::Written& session);

}  // namespace palpate
