#include "engine/base/trace.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>

#include "engine/base/clock.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kMostHeld = 1 << 16;
constexpr int64_t kLongestHeld_ns = 500'000'000;
constexpr char kEnd[] = "\n]\n";

/// The one file, its events that are not written yet, and the threads in it.
struct Open {
  std::mutex mutex;
  const TraceFile* owner = nullptr;
  int file = -1;  // none once the disk has refused
  std::filesystem::path path;
  std::function<void(const std::string&)> refused;
  off_t whole = 0;  // bytes of the file without kEnd
  int64_t start_ns = 0, written_ns = 0;
  uint64_t number = 0;  // of the file, from 1
  uint32_t threads = 0;
  bool any = false;
  std::string held;
};

Open& the_open() {
  static Open one;
  return one;
}

struct Thread {
  const char* name = nullptr;
  uint32_t number = 0;
  uint64_t file = 0;  // that has it
};
thread_local Thread this_thread;

/// In one write, that a kill does not cut, where the disk has room; errno says what hindered it.
bool write_at(const Open& open, const std::string& bytes, off_t at) {
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t now =
        ::pwrite(open.file, bytes.data() + done, bytes.size() - done, at + static_cast<off_t>(done));
    if (now <= 0) return false;
    done += static_cast<size_t>(now);
  }
  return true;
}

/// Over the end of the last time, so that the file is whole after each. A disk that refuses ends the file
/// with what it had; then the answer says so, else it is empty.
std::string write_out(Open& open) {
  open.written_ns = monotonic_ns();
  const std::string bytes = std::exchange(open.held, {});
  if (bytes.empty()) return "";
  if (write_at(open, bytes + kEnd, open.whole)) {
    open.whole += static_cast<off_t>(bytes.size());
    return "";
  }
  const std::string why = std::strerror(errno);
  const bool whole = ::ftruncate(open.file, open.whole) == 0 && write_at(open, kEnd, open.whole);
  ::close(std::exchange(open.file, -1));
  return Error(Failure::Output, "to go on with the trace '" + open.path.string() + "'",
               why + (whole ? "; it ends early" : "; its end is cut"),
               "freeing disk space; the run goes on without it")
      .what();
}

void add(Open& open, const char* line) {
  open.held += std::exchange(open.any, true) ? ",\n" : "\n";
  open.held += line;
}

void add_thread(Open& open) {
  Thread& thread = this_thread;
  thread.file = open.number;
  thread.number = ++open.threads;
  std::array<char, 160> line{};
  const std::string other = "thread " + std::to_string(thread.number);
  std::snprintf(line.data(), line.size(),
                R"({"name":"thread_name","ph":"M","pid":1,"tid":%u,"args":{"name":"%s"}})", thread.number,
                thread.name ? thread.name : other.c_str());
  add(open, line.data());
}

}  // namespace

std::atomic<bool> TraceSpan::on = false;

TraceFile::TraceFile(const std::filesystem::path& path, std::function<void(const std::string&)> refused) {
  Open& open = the_open();
  const std::lock_guard lock(open.mutex);
  const std::string wanted = "to write the trace '" + path.string() + "'";
  if (open.owner)
    throw Error(Failure::Output, wanted, "the trace '" + open.path.string() + "', which is not finished",
                "one trace at a time in a process");
  const std::string begin = "[";
  open.file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (open.file < 0 || !write_at(open, begin + kEnd, 0)) {
    const int why = errno;
    if (open.file >= 0) ::close(std::exchange(open.file, -1));
    throw Error(Failure::Output, wanted, std::strerror(why), "a file in a folder that exists and has room");
  }
  open.whole = static_cast<off_t>(begin.size());
  open.owner = this;
  open.path = path;
  open.refused = std::move(refused);
  open.start_ns = open.written_ns = monotonic_ns();
  ++open.number;
  open.threads = 0;
  open.any = false;
  TraceSpan::on = true;
}

TraceFile::~TraceFile() {
  TraceSpan::on = false;
  Open& open = the_open();
  std::unique_lock lock(open.mutex);
  const std::string refusal = open.file < 0 ? "" : write_out(open);
  if (open.file >= 0) ::close(std::exchange(open.file, -1));
  open.owner = nullptr;
  const auto refused = std::exchange(open.refused, nullptr);
  lock.unlock();
  if (!refusal.empty() && refused) refused(refusal);
}

void name_trace_thread(const char* name) {
  this_thread.name = name;
}

void TraceSpan::begin(const char* name) {
  name_ = name;
  start_ns_ = monotonic_ns();
}

void TraceSpan::end() const {
  const int64_t end_ns = monotonic_ns();
  Open& open = the_open();
  std::unique_lock lock(open.mutex);
  // Begun before the file, or ended after it.
  if (open.file < 0 || start_ns_ < open.start_ns) return;
  if (this_thread.file != open.number) add_thread(open);
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), R"({"name":"%s","ph":"X","ts":%.3f,"dur":%.3f,"pid":1,"tid":%u})",
                name_, 1e-3 * static_cast<double>(start_ns_ - open.start_ns),
                1e-3 * static_cast<double>(end_ns - start_ns_), this_thread.number);
  add(open, line.data());
  if (open.held.size() <= kMostHeld && end_ns - open.written_ns <= kLongestHeld_ns) return;
  const std::string refusal = write_out(open);
  if (refusal.empty()) return;
  TraceSpan::on = false;
  const auto refused = open.refused;
  lock.unlock();
  if (refused) refused(refusal);
}

}  // namespace palpate
