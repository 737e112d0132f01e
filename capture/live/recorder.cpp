#include "capture/live/recorder.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <iterator>
#include <utility>

#include "capture/log/session_logs.h"
#include "engine/base/text.h"

namespace palpate {

std::filesystem::path new_session_folder(const std::filesystem::path& parent) {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm local{};
  localtime_r(&now, &local);
  char name[40];
  std::strftime(name, sizeof name, "session-%Y%m%d-%H%M%S", &local);
  std::filesystem::path folder = parent / name;
  for (int n = 2; std::filesystem::exists(folder); ++n)
    folder = parent / (std::string(name) + "-" + std::to_string(n));
  return folder;
}

Recording::Recording(std::function<std::filesystem::path()> folder, SessionInfo info, SessionOptions options)
    : folder_(std::move(folder)), info_(std::move(info)), options_(options) {}

Recording::~Recording() {
  finish();
}

void Recording::log(const std::string& name, std::string_view line) {
  const std::lock_guard lock(logs_mutex_);
  const std::string plain = plain_log_name(name);
  auto at = std::ranges::find_if(logs_, [&](const auto& log) { return log->name() == plain; });
  if (at == logs_.end()) {
    logs_.push_back(LogInput::of_program(plain));
    at = std::prev(logs_.end());
    const std::lock_guard session(mutex_);
    if (current_) (*at)->write_to(current_->folder / kLogFolder);
  }
  (*at)->add(line);
}

void Recording::start() {
  if (on()) return;
  Current next{.folder = folder_(), .writer = {}};
  next.writer = std::make_shared<SessionWriter>(next.folder, info_, options_);
  if (cancelled_) next.writer->watch(cancelled_);
  const std::lock_guard logs_lock(logs_mutex_);
  for (const auto& log : logs_) log->write_to(next.folder / kLogFolder);
  const std::lock_guard lock(mutex_);
  latest_ = next;
  current_ = std::move(next);
}

void Recording::stop() {
  if (!on()) return;
  std::vector<LogEnding> logs;
  {
    const std::lock_guard logs_lock(logs_mutex_);
    for (const auto& log : logs_) logs.push_back(log->end());
  }
  Current ended;
  {
    const std::lock_guard lock(mutex_);
    ended = std::move(*current_);
    current_.reset();
  }
  // The threads of those before end here, so that sessions may come and go without end.
  while (!closing_.empty() &&
         closing_.front().wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    written_.push_back(closing_.front().get());
    closing_.pop_front();
  }
  // The queue may hold seconds of frames: the window must not wait for the disk.
  closing_.push_back(std::async(std::launch::async, [held = std::move(ended),
                                                     logs = std::move(logs)]() mutable {
    const Current session = std::move(held);  // its memory and files go with this call, not with its answer
    return close(session, logs);
  }));
}

/// Writes what is left of a session.
Recording::Written Recording::close(const Current& session, std::vector<LogEnding>& logs) {
  std::vector<std::string> troubles;
  for (LogEnding& log : logs) {
    const LogStatus status = log.close();
    if (status.dropped > 0)
      troubles.push_back(
          text("%s: %llu lines lost", status.name.c_str(), static_cast<unsigned long long>(status.dropped)));
    if (!status.error.empty()) troubles.push_back(status.name + ": ENDED EARLY: " + status.error);
  }
  Written written{session.folder, session.writer->close(), finish_session_logs(session.folder)};
  written.logs.insert(written.logs.end(), troubles.begin(), troubles.end());
  return written;
}

bool Recording::on() const {
  const std::lock_guard lock(mutex_);
  return current_.has_value();
}

std::shared_ptr<SessionWriter> Recording::writer() const {
  const std::lock_guard lock(mutex_);
  return current_ ? current_->writer : nullptr;
}

bool Recording::record(Frame& frame) {
  const std::shared_ptr<SessionWriter> to = writer();
  if (!to) return true;
  const bool gap = frame.after_gap;
  if (to != recorded_to_.lock()) frame.after_gap = true;
  if (to->record(frame)) {
    recorded_to_ = to;
    return true;
  }
  frame.after_gap = gap;
  // A session that was stopped meanwhile, or has failed, has no say in what is measured.
  return writer() != to || !to->status().error.empty();
}

void Recording::measured(const Touch& touch, int64_t ready_ns) {
  if (const std::shared_ptr<SessionWriter> to = writer()) to->measured(touch, ready_ns);
}

Recording::Written Recording::latest() const {
  const std::lock_guard lock(mutex_);
  return latest_.writer ? Written{latest_.folder, latest_.writer->status()} : Written{};
}

std::vector<Recording::Written> Recording::finish() {
  stop();
  std::vector<Written> written = std::move(written_);
  written_.clear();
  for (; !closing_.empty(); closing_.pop_front()) written.push_back(closing_.front().get());
  return written;
}

std::string describe(const Recording::Written& session) {
  const std::string line = palpate::text(": %llu frames, %llu dropped, %llu measured, %.1f MB",
                                         static_cast<unsigned long long>(session.status.written),
                                         static_cast<unsigned long long>(session.status.dropped),
                                         static_cast<unsigned long long>(session.status.measured),
                                         1e-6 * static_cast<double>(session.status.written_bytes));
  std::string text = session.folder.string() + line;
  if (!session.status.error.empty()) text += "; ENDED EARLY: " + session.status.error;
  for (const std::string& log : session.logs) text += "\nlog " + log;
  return text;
}

}  // namespace palpate
