#include "capture/pair/pair_recording.h"

#include <utility>

#include "capture/files/measurements.h"
#include "capture/log/session_logs.h"
#include "capture/pair/pair_clock.h"
#include "capture/run/record_session.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {

PairRows::PairRows(fs::path folder, PairInfo info, std::optional<KnownGrip> grip)
    : folder_(std::move(folder)), info_(std::move(info)), grip_(std::move(grip)), file_(folder_ / kPairRows) {
  file_.append(grip_header());
  write_pair_info(folder_, info_);
}

GripFrame PairRows::add(const Matched<FingerTouch>& pair, double time_s) {
  if (!meter_) {
    if (grip_) {
      grip_ = grip_->from(time_s);
      info_.grip = grip_->keep(folder_);
      write_pair_info(folder_, info_);
    }
    meter_.emplace(grip_);
  }
  if (pair.both())
    info_.skew.add(pair.skew_ns);
  else
    ++info_.alone[pair.left() ? 0 : 1];
  const GripFrame frame = meter_->add(pair);
  file_.append(grip_row(frame));
  ++rows_;
  return frame;
}

void PairRows::close() {
  file_.close();
  info_.complete = true;
  write_pair_info(folder_, info_);
}

PairRecording::PairRecording(std::function<fs::path()> folder, const std::array<OpenFinger, 2>& fingers,
                             const gpu::Context& context, std::optional<KnownGrip> grip, bool no_drop,
                             const RunWatch& watch)
    : folder_(std::move(folder)), info_(pair_info(fingers)), grip_(std::move(grip)) {
  for (const Side side : kSides) {
    const OpenFinger& finger = fingers[index(side)];
    fingers_[index(side)].emplace(
        [this, side] { return finger_folder(next_, side); },
        session_info(finger.found, *finger.source, finger.background, finger.pipeline, context),
        SessionOptions{.no_drop = no_drop || finger.live.measure_all});
    of(side).watch([&watch] { return watch.stopped(); });
  }
}

void PairRecording::start() {
  if (on()) return;
  const std::lock_guard lock(mutex_);
  end_rows();
  next_ = folder_();
  make_output_folder(next_);
  rows_.emplace(next_, info_, grip_);
  past_ = {};
  for (const Side side : kSides) of(side).start();
  logs_.write_to(next_ / kLogFolder);
  written_.emplace_back().folder = next_;
}

void PairRecording::stop() {
  if (!on()) return;
  for (const Side side : kSides) of(side).stop();
  std::vector<LogEnding> endings = logs_.end();
  const std::vector<std::string> troubles = close_logs(endings);
  const std::lock_guard lock(mutex_);
  written_.back().logs = troubles;
}

bool PairRecording::on() const {
  return fingers_[0]->on() || fingers_[1]->on();
}

std::optional<GripFrame> PairRecording::add(const Matched<FingerTouch>& pair) {
  const std::lock_guard lock(mutex_);
  if (!zero_ns_) zero_ns_ = begin_of(pair);
  if (!rows_) return std::nullopt;
  Matched<FingerTouch> recorded = pair;
  for (const Side side : kSides) {
    std::optional<FingerTouch>& finger = recorded.of[index(side)];
    if (!finger) continue;
    const SessionStatus status = of(side).latest().status;
    const uint64_t frame = finger->touch.sequence;
    if (status.recorded > 0 && frame >= status.first_frame && frame <= status.last_frame) continue;
    past_[index(side)] |= !of(side).on();
    finger.reset();
  }
  if (!recorded.both()) recorded.skew_ns = 0;
  std::optional<GripFrame> row;
  if (recorded.left() || recorded.right())
    attempt([&] { row = rows_->add(recorded, 1e-9 * static_cast<double>(begin_of(recorded) - *zero_ns_)); });
  if (past_[0] && past_[1]) end_rows();
  return row;
}

/// Under the lock.
void PairRecording::end_rows() {
  if (!rows_) return;
  written_.back().rows = last_rows_ = rows_->rows();
  attempt([this] { rows_->close(); });
  rows_.reset();
}

/// Under the lock. What cannot be written any more ends the rows, whose last one is whole.
void PairRecording::attempt(const std::function<void()>& write) {
  try {
    write();
  } catch (const Error& error) {
    written_.back().rows = rows_->rows();
    written_.back().rows_error = error.what();
    rows_.reset();
  }
}

PairRecording::Written PairRecording::latest() const {
  Written latest;
  {
    const std::lock_guard lock(mutex_);
    if (!written_.empty()) latest = written_.back();
    latest.folder = next_;
    latest.rows = rows_ ? rows_->rows() : last_rows_;
  }
  for (const Side side : kSides) latest.sessions[index(side)] = fingers_[index(side)]->latest();
  return latest;
}

std::vector<PairRecording::Written> PairRecording::finish() {
  stop();
  const std::lock_guard lock(mutex_);
  end_rows();
  for (const Side side : kSides) {
    const std::vector<Recording::Written> sessions = of(side).finish();
    for (size_t i = 0; i < written_.size(); ++i) written_[i].sessions[index(side)] = sessions.at(i);
  }
  for (Written& one : written_) {
    const std::vector<std::string> lines = finish_session_logs(
        one.folder, [](const fs::path& folder) { return pair_clock(folder, folder / kPairRows); });
    one.logs.insert(one.logs.begin(), lines.begin(), lines.end());
  }
  return std::exchange(written_, {});
}

}  // namespace palpate
