#include "engine/base/trace.h"

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
  std::FILE* file = nullptr;
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

// Over the end of the last time, so that the file is whole after each.
void write_out(Open& open) {
  open.written_ns = monotonic_ns();
  if (open.held.empty()) return;
  std::fseek(open.file, -static_cast<long>(sizeof kEnd - 1), SEEK_END);
  open.held += kEnd;
  std::fwrite(open.held.data(), 1, open.held.size(), open.file);
  std::fflush(open.file);
  open.held.clear();
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

TraceFile::TraceFile(const std::filesystem::path& path) {
  Open& open = the_open();
  const std::lock_guard lock(open.mutex);
  open.file = std::fopen(path.c_str(), "wb");
  if (open.file)
    std::setvbuf(open.file, nullptr, _IONBF, 0);  // one write at a time, that a kill does not cut
  const bool written = open.file && std::fprintf(open.file, "[%s", kEnd) > 0 && std::fflush(open.file) == 0;
  if (!written) {
    const int why = errno;
    if (open.file) std::fclose(std::exchange(open.file, nullptr));
    throw Error(Failure::Output, "to write the trace '" + path.string() + "'", std::strerror(why),
                "a file in a folder that exists and has room");
  }
  open.start_ns = open.written_ns = monotonic_ns();
  ++open.number;
  open.threads = 0;
  open.any = false;
  TraceSpan::on = true;
}

TraceFile::~TraceFile() {
  TraceSpan::on = false;
  Open& open = the_open();
  const std::lock_guard lock(open.mutex);
  write_out(open);
  std::fclose(open.file);
  open.file = nullptr;
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
  const std::lock_guard lock(open.mutex);
  // Begun before the file, or ended after it.
  if (!open.file || start_ns_ < open.start_ns) return;
  if (this_thread.file != open.number) add_thread(open);
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), R"({"name":"%s","ph":"X","ts":%.3f,"dur":%.3f,"pid":1,"tid":%u})",
                name_, 1e-3 * static_cast<double>(start_ns_ - open.start_ns),
                1e-3 * static_cast<double>(end_ns - start_ns_), this_thread.number);
  add(open, line.data());
  if (open.held.size() > kMostHeld || end_ns - open.written_ns > kLongestHeld_ns) write_out(open);
}

}  // namespace palpate
