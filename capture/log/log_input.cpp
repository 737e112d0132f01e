#include "capture/log/log_input.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <iterator>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "capture/files/output_file.h"
#include "capture/log/log_table.h"
#include "engine/base/clock.h"
#include "engine/base/readable.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {

enum class LogKind : uint8_t { File, Stream, Port, Program };

/// A descriptor that is closed at the end, other than standard input.
class LogDescriptor {
 public:
  explicit LogDescriptor(int fd = -1) : fd_(fd) {}
  ~LogDescriptor() {
    if (fd_ > 2) ::close(fd_);
  }
  LogDescriptor(LogDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  LogDescriptor& operator=(LogDescriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

/// NAME.lines of a session. Nobody who writes a line waits for the disk.
class LogFile {
 public:
  explicit LogFile(const fs::path& path) : lines_(path) {}
  /// One call at a time.
  void append(std::string_view line) { lines_.append(line); }
  void sync() {
    const std::lock_guard lock(disk_);
    if (!closed_) lines_.sync();
  }
  /// After the last line.
  void close() {
    const std::lock_guard lock(disk_);
    closed_ = true;
    lines_.close();
  }

 private:
  LineFile lines_;
  std::mutex disk_;
  bool closed_ = false;
};

namespace {

constexpr auto kSyncEvery = std::chrono::milliseconds(400);
constexpr auto kDrain = std::chrono::seconds(2);  // of what comes faster than it can be read
constexpr size_t kRead_B = 64 << 10;
constexpr int kPortQueue_B = 4 << 20;

[[noreturn]] void refuse(const std::string& what, const std::string& found) {
  throw Error(Failure::Input, "a log to read", what + ": " + found, "another path, - or udp:PORT");
}

bool is_regular(const LogDescriptor& input, const std::string& what) {
  struct stat facts {};
  if (::fstat(input.get(), &facts) != 0) refuse(what, system_words(errno));
  return S_ISREG(facts.st_mode);
}

LogDescriptor open_port(const std::string& what, uint16_t& port) {
  const std::string number = what.substr(4);
  unsigned value = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (error != std::errc() || end != number.data() + number.size() || number.empty() || value > 65535)
    throw Error(Failure::Usage, "a port from 0 to 65535 behind udp:", "'" + what + "'", "udp:9750");
  LogDescriptor fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(value));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int one = 1;
  if (fd.get() < 0 || ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw Error(Failure::Input, "a free UDP port for the log", what + ": " + system_words(errno),
                "another port");
  ::setsockopt(fd.get(), SOL_SOCKET, SO_RCVBUF, &kPortQueue_B, sizeof kPortQueue_B);
  ::setsockopt(fd.get(), SOL_SOCKET, SO_RXQ_OVFL, &one, sizeof one);
  socklen_t length = sizeof address;
  ::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &length);
  port = ntohs(address.sin_port);
  return fd;
}

}  // namespace

std::string plain_log_name(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    name += letter ? c : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : '_';
  }
  return name.empty() ? "log" : name.substr(0, 60);
}

LogName log_name(const std::string& given) {
  LogName log{{}, given};
  const size_t equals = given.find('=');
  if (equals != std::string::npos && given.find('/') > equals)
    log = {plain_log_name(given.substr(0, equals)), given.substr(equals + 1)};
  if (log.what.empty())
    throw Error(Failure::Usage, "FILE, - or udp:PORT for --log", "'" + given + "'", "--log robot.csv");
  if (log.name.empty())
    log.name = log.what == "-"  ? "stdin"
               : !log.is_file() ? "udp"
                                : plain_log_name(fs::path(log.what).stem().string());
  return log;
}

struct LogInput::Impl {
  std::string name;
  LogKind kind = LogKind::File;
  uint16_t listening = 0;
  LogDescriptor input, changes, wake;
  bool whole_file = false;  ///< its lines have no times of arrival: standard input from a file
  off_t read_to = 0;
  bool news = false;  ///< what a file holds from here on arrived while we listened

  mutable std::mutex mutex;
  std::shared_ptr<LogFile> file;
  std::string first_line;  ///< with its stamp
  bool first_written = false;
  std::vector<std::string> held;  ///< stamped lines of a file, until a session takes them
  LogStatus status;
  std::string part;  ///< of a line whose end has not come
  bool too_long = false;
  uint64_t lost_by_port = 0;
  uint64_t drains_wanted = 0, drains_done = 0;  ///< of what was there to be read
  std::condition_variable drained;
  std::atomic<bool> stop{false};
  std::thread thread;

  void open(const LogName& given);
  void wake_up() const;
  void drain(std::unique_lock<std::mutex>& lock);
  void run();
  void sync();
  bool read_some();
  bool read_stream();
  bool read_port();
  void bytes(std::string_view text, int64_t at_ns);
  void line(std::string_view text, int64_t at_ns);
  void write(const std::string& stamped);
};

void LogInput::Impl::open(const LogName& given) {
  const std::string& what = given.what;
  status.name = name = given.name;
  wake = LogDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (what.starts_with("udp:")) {
    kind = LogKind::Port;
    input = open_port(what, listening);
    return;
  }
  if (what == "-") {
    kind = LogKind::Stream;
    input = LogDescriptor(STDIN_FILENO);
    whole_file = is_regular(input, what);
    return;
  }
  std::error_code code;
  if (fs::is_directory(what, code)) refuse(what, "a folder");
  input = LogDescriptor(::open(what.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (input.get() < 0) refuse(what, system_words(errno));
  if (!is_regular(input, what)) kind = LogKind::Stream;  // a named pipe
  changes = LogDescriptor(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK));
  if (changes.get() >= 0) ::inotify_add_watch(changes.get(), what.c_str(), IN_MODIFY);
}

void LogInput::Impl::wake_up() const {
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t woken = ::write(wake.get(), &one, sizeof one);
}

/// Waits until what is there has been read.
void LogInput::Impl::drain(std::unique_lock<std::mutex>& lock) {
  const uint64_t wanted = ++drains_wanted;
  wake_up();
  drained.wait_for(lock, kDrain, [&] { return drains_done >= wanted || stop; });
}

/// A line of a file that was there before has no time of arrival.
void LogInput::Impl::line(std::string_view text, int64_t at_ns) {
  const bool known = !whole_file && (kind != LogKind::File || news);
  std::string stamped = std::to_string(known ? at_ns : 0) + '\t' + std::string(text);
  if (first_line.empty()) first_line = stamped;
  if (file) {
    write(stamped);
  } else if (!known) {
    held.push_back(std::move(stamped));
  }
}

void LogInput::Impl::write(const std::string& stamped) {
  if (!status.error.empty()) return;
  try {
    if (!first_written && stamped != first_line) file->append(first_line);
    first_written = true;
    file->append(stamped);
    ++status.lines;
  } catch (const std::exception& error) {
    status.error = error.what();
  }
}

/// Whole lines go on, the rest waits for its end.
void LogInput::Impl::bytes(std::string_view text, int64_t at_ns) {
  const std::lock_guard lock(mutex);
  while (!text.empty()) {
    const size_t end = text.find('\n');
    const std::string_view piece = text.substr(0, end);
    if (part.size() + piece.size() > kLongestLogLine_B) too_long = true;
    if (!too_long) part += piece;
    if (end == std::string_view::npos) return;
    text.remove_prefix(end + 1);
    if (too_long)
      ++status.dropped;
    else if (!part.empty())
      line(part, at_ns);
    part.clear();
    too_long = false;
  }
}

/// True where more may be there at once.
bool LogInput::Impl::read_stream() {
  std::array<char, kRead_B> buffer;
  if (kind == LogKind::File) {
    struct stat facts {};
    if (::fstat(input.get(), &facts) == 0 && facts.st_size < read_to) {
      ::lseek(input.get(), 0, SEEK_SET);  // begun anew
      read_to = 0;
    }
  }
  const ssize_t count = ::read(input.get(), buffer.data(), buffer.size());
  if (count > 0) {
    read_to += count;
    bytes({buffer.data(), static_cast<size_t>(count)}, monotonic_ns());
    return true;
  }
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return false;
  if (kind == LogKind::File) {
    news = true;
    return false;
  }
  bytes("\n", monotonic_ns());  // a last line without its end
  const std::lock_guard lock(mutex);
  status.ended = true;
  return false;
}

bool LogInput::Impl::read_port() {
  std::array<char, kRead_B> buffer;
  alignas(cmsghdr) std::array<char, 128> control{};
  iovec part_of{buffer.data(), buffer.size()};
  msghdr message{};
  message.msg_iov = &part_of;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t count = ::recvmsg(input.get(), &message, MSG_DONTWAIT);
  if (count < 0) return false;
  const int64_t at_ns = monotonic_ns();
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL) continue;
    uint32_t lost = 0;
    std::memcpy(&lost, CMSG_DATA(c), sizeof lost);
    const std::lock_guard lock(mutex);
    status.dropped += lost - lost_by_port;
    lost_by_port = lost;
  }
  bytes({buffer.data(), static_cast<size_t>(count)}, at_ns);
  bytes("\n", at_ns);  // a datagram ends a line
  return true;
}

bool LogInput::Impl::read_some() {
  switch (kind) {
    case LogKind::Port:
      return read_port();
    case LogKind::Program:
      return false;
    case LogKind::File:
    case LogKind::Stream:
      break;
  }
  return read_stream();
}

void LogInput::Impl::run() {
  auto synced = std::chrono::steady_clock::now();
  while (!stop) {
    std::array<char, 4096> drain;
    const uint64_t wanted = [this] {
      const std::lock_guard lock(mutex);
      return drains_wanted;
    }();
    while (!stop && read_some()) {
    }
    {
      const std::lock_guard lock(mutex);
      drains_done = wanted;
    }
    drained.notify_all();
    const bool ended = status.ended;  // written by this thread alone
    const int watched = kind == LogKind::File ? changes.get() : ended ? -1 : input.get();
    std::array<pollfd, 2> waits{pollfd{watched, POLLIN, 0}, pollfd{wake.get(), POLLIN, 0}};
    ::poll(waits.data(), waits.size(), static_cast<int>(kSyncEvery.count()));
    for (const int fd : {wake.get(), changes.get()})
      while (fd >= 0 && ::read(fd, drain.data(), drain.size()) > 0) {
      }
    const auto now = std::chrono::steady_clock::now();
    if (now - synced < kSyncEvery) continue;
    synced = now;
    sync();
  }
}

/// Without the lock: those who write lines do not wait.
void LogInput::Impl::sync() {
  const std::shared_ptr<LogFile> to = [this] {
    const std::lock_guard lock(mutex);
    return status.error.empty() ? file : nullptr;
  }();
  if (!to) return;
  try {
    to->sync();
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex);
    if (file == to) status.error = error.what();
  }
}

LogInput::LogInput() : impl_(std::make_unique<Impl>()) {}

LogInput::LogInput(const std::string& given) : LogInput() {
  impl_->open(log_name(given));
  start();
}

std::unique_ptr<LogInput> LogInput::of_program(const std::string& name) {
  std::unique_ptr<LogInput> log(new LogInput);
  log->impl_->kind = LogKind::Program;
  log->impl_->status.name = log->impl_->name = plain_log_name(name);
  log->impl_->wake = LogDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  log->start();
  return log;
}

void LogInput::start() {
  impl_->thread = std::thread([this] { impl_->run(); });
}

LogInput::~LogInput() {
  if (!impl_->thread.joinable()) return;  // what could not be opened
  finish();
  impl_->stop = true;
  impl_->wake_up();
  impl_->thread.join();
}

void LogInput::add(std::string_view line) {
  const int64_t at_ns = monotonic_ns();
  const std::lock_guard lock(impl_->mutex);
  if (line.size() > kLongestLogLine_B)
    ++impl_->status.dropped;
  else if (!line.empty())
    impl_->line(line, at_ns);
}

const std::string& LogInput::name() const {
  return impl_->name;
}

uint16_t LogInput::port() const {
  return impl_->listening;
}

void LogInput::write_to(const fs::path& folder) {
  finish();
  make_output_folder(folder);
  Impl& m = *impl_;
  std::unique_lock lock(m.mutex);
  m.drain(lock);  // of what came before
  m.file = std::make_shared<LogFile>(folder / (m.name + kLogLines));
  m.status.lines = m.status.dropped = 0;
  m.status.error.clear();
  m.first_written = false;
  for (const std::string& stamped : m.held) m.write(stamped);
}

LogEnding LogInput::end() {
  Impl& m = *impl_;
  std::unique_lock lock(m.mutex);
  if (m.file) m.drain(lock);
  LogEnding ending;
  ending.file_ = std::exchange(m.file, nullptr);
  ending.status_ = m.status;
  return ending;
}

LogStatus LogEnding::close() {
  if (const std::shared_ptr<LogFile> file = std::exchange(file_, nullptr)) try {
      file->close();
    } catch (const std::exception& error) {
      if (status_.error.empty()) status_.error = error.what();
    }
  return status_;
}

LogStatus LogInput::status() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->status;
}

void LogSet::take(std::vector<std::unique_ptr<LogInput>> logs) {
  const std::lock_guard lock(mutex_);
  logs_ = std::move(logs);
}

void LogSet::add(const std::string& name, std::string_view line) {
  const std::lock_guard lock(mutex_);
  const std::string plain = plain_log_name(name);
  auto at = std::ranges::find_if(logs_, [&](const auto& log) { return log->name() == plain; });
  if (at == logs_.end()) {
    logs_.push_back(LogInput::of_program(plain));
    at = std::prev(logs_.end());
    if (!folder_.empty()) (*at)->write_to(folder_);
  }
  (*at)->add(line);
}

void LogSet::write_to(const std::filesystem::path& folder) {
  const std::lock_guard lock(mutex_);
  folder_ = folder;
  for (const auto& log : logs_) log->write_to(folder);
}

std::vector<LogEnding> LogSet::end() {
  std::vector<LogEnding> endings;
  const std::lock_guard lock(mutex_);
  folder_.clear();
  for (const auto& log : logs_) endings.push_back(log->end());
  return endings;
}

std::vector<std::string> close_logs(std::vector<LogEnding>& endings) {
  std::vector<std::string> troubles;
  for (LogEnding& ending : endings) {
    const LogStatus status = ending.close();
    if (status.dropped > 0)
      troubles.push_back(
          text("%s: %llu lines lost", status.name.c_str(), static_cast<unsigned long long>(status.dropped)));
    if (!status.error.empty()) troubles.push_back(status.name + ": ENDED EARLY: " + status.error);
  }
  return troubles;
}

std::vector<std::unique_ptr<LogInput>> open_logs(const std::vector<std::string>& given) {
  std::vector<std::unique_ptr<LogInput>> logs;
  std::set<std::string> names;
  for (const std::string& one : given) {
    logs.push_back(std::make_unique<LogInput>(one));
    if (!names.insert(logs.back()->name()).second)
      throw Error(Failure::Usage, "a name of its own for each log", "two logs '" + logs.back()->name() + "'",
                  "NAME=" + one);
  }
  return logs;
}

}  // namespace palpate
