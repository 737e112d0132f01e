#include "capture/live/recorder.h"

#include <chrono>
#include <cstdio>
#include <ctime>
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

void Recording::start() {
  if (on()) return;
  Current next{.folder = folder_(), .writer = {}};
  next.writer = std::make_shared<SessionWriter>(next.folder, info_, options_);
  if (cancelled_) next.writer->watch(cancelled_);
  logs_.write_to(next.folder / kLogFolder);
  const std::lock_guard lock(mutex_);
  latest_ = next;
  current_ = std::move(next);
}

void Recording::stop() {
  if (!on()) return;
  std::vector<LogEnding> logs = logs_.end();
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
    const std::vector<std::string> troubles = close_logs(logs);
    Written written{session.folder, session.writer->close(), finish_session_logs(session.folder)};
    written.logs.insert(written.logs.end(), troubles.begin(), troubles.end());
    return written;
  }));
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
