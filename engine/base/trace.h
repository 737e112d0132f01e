// Trace: what each thread does when, as a file that chrome://tracing and Perfetto open. Off, a span costs one
// branch.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace palpate {

/// The threads' spans while it lives, in Chrome's trace format: an array of complete events, times in us
/// since its start. The file is whole JSON whenever it is looked at, also after a process that was killed;
/// then the last half second is missing.
class TraceFile {
 public:
  /// One at a time in a process. `refused` is called once, on any thread, with a line for a person where the
  /// disk takes no more: the file then ends early and is still whole. Throws Error(Failure::Output) where it
  /// cannot be begun.
  explicit TraceFile(const std::filesystem::path& path,
                     std::function<void(const std::string&)> refused = nullptr);
  ~TraceFile();
  TraceFile(const TraceFile&) = delete;
  TraceFile& operator=(const TraceFile&) = delete;
};

/// Names the calling thread in traces, for good; `name` stays.
void name_trace_thread(const char* name);

/// A span: what the calling thread does from here to the end of its scope.
class TraceSpan {
 public:
  /// `name` stays, and needs no escapes.
  explicit TraceSpan(const char* name) {
    if (on.load(std::memory_order_relaxed)) begin(name);
  }
  ~TraceSpan() {
    if (name_) end();
  }
  TraceSpan(const TraceSpan&) = delete;
  TraceSpan& operator=(const TraceSpan&) = delete;

 private:
  friend class TraceFile;
  void begin(const char* name);
  void end() const;

  static std::atomic<bool> on;
  const char* name_ = nullptr;
  int64_t start_ns_ = 0;
};

}  // namespace palpate
