#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "capture/files/images/images.h"
#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/session/info.h"
#include "capture/session/session.h"
#include "capture/video/session_video.h"
#include "engine/base/clock.h"
#include "engine/base/trace.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {

using FramePointer = std::unique_ptr<Frame>;
using Clock = std::chrono::steady_clock;

/// A frame that waits for the encoder.
struct QueuedFrame {
  FramePointer frame;
  Clock::time_point since;
};

/// A recorded frame on its way to a row of frames.csv.
struct StampRow {
  FrameStamp stamp;
  bool in_video = false;
  int64_t measured_ns = 0;
  std::optional<std::string> cells;
};

namespace {

constexpr auto kSyncEvery = std::chrono::milliseconds(400);
constexpr auto kAskEvery = std::chrono::milliseconds(50);
constexpr auto kRowsEvery = std::chrono::milliseconds(100);

std::string row_header() {
  return "frame,driver_time_ns,host_time_ns,host_delivered_ns,host_measured_ns,time_s,after_gap,measured," +
         Measurements::cell_names();
}

std::string row_text(const StampRow& row) {
  const FrameStamp& s = row.stamp;
  const auto known = [](int64_t time_ns) { return time_ns == 0 ? std::string() : std::to_string(time_ns); };
  static const std::string empty = [] {
    const std::string names = Measurements::cell_names();
    return std::string(static_cast<size_t>(std::count(names.begin(), names.end(), ',')), ',');
  }();
  std::string text = std::to_string(s.sequence) + ',' + std::to_string(s.time_ns);
  for (const int64_t host_ns : {s.exposed_ns, s.delivered_ns, row.measured_ns}) text += ',' + known(host_ns);
  text += ',' + shortest(static_cast<double>(s.time_ns) / 1e9) + ',' + (s.after_gap ? '1' : '0');
  return text + ',' + (row.cells ? '1' : '0') + ',' + row.cells.value_or(empty);
}

void write_background(const fs::path& file, const Frame& frame) {
  const std::vector<uint8_t> png = encode_image(frame, ".png");
  OutputFile out(file);
  out.write(png.data(), png.size());
  out.commit_durably();
}

void write_text(const fs::path& folder, const std::string& text) {
  OutputFile out(folder / kSessionJson);
  out.write(text);
  out.commit_durably();
}

/// Refuses what cannot be read back, and leaves out of the sensor what the session holds itself.
SessionInfo checked(const SessionInfo& given) {
  SessionInfo info = given;
  const FrameFormat& f = info.format;
  if (f.width == 0 || f.height == 0 || f.width > kMaxSide_px || f.height > kMaxSide_px ||
      (f.channels != 1 && f.channels != 3) || f.bit_depth < 8 || f.bit_depth > (f.channels == 3 ? 8u : 16u))
    throw Error(Failure::Output, "frames of gray with 8 to 16 bits or colour with 8, to record",
                std::to_string(f.width) + "x" + std::to_string(f.height) + " px, " +
                    std::to_string(f.channels) + " channels of " + std::to_string(f.bit_depth) + " bits",
                "another format");
  if (info.background && info.background->format != f)
    throw Error(Failure::Output, "a background of the frames' format", "another",
                "the background of this sensor");
  if (!(info.rate_Hz > 0 && info.rate_Hz < 1e6)) info.rate_Hz = 0;
  if (info.sensor && !std::isfinite(info.sensor->pitch_mm_per_px)) info.sensor.reset();
  if (info.sensor && info.background) info.sensor->background.image.clear();
  return info;
}

fs::path fresh_folder(const fs::path& folder) {
  make_output_folder(folder);
  for (const char* name : {kSessionJson, kSessionFrames, kSessionRows}) {
    if (fs::exists(fs::symlink_status(folder / name)))
      throw Error(Failure::Output, "a folder without a session to record to",
                  "'" + (folder / name).string() + "'",
                  "another --out folder; a recording is never overwritten");
  }
  return folder;
}

}  // namespace

struct SessionWriter::Impl {
  const fs::path folder;
  const SessionInfo info;
  const SessionOptions options;
  const SessionStart start = {utc_now(), wall_clock()};
  const size_t most_queued;
  std::unique_ptr<SessionVideoWriter> video;
  std::optional<LineFile> rows_file;
  std::function<bool()> cancelled;

  mutable std::mutex mutex;
  std::condition_variable work, room, end_sync;
  std::deque<QueuedFrame> queue;    ///< oldest first
  std::vector<FramePointer> spare;  ///< memory of frames that are written
  size_t held = 0;                  ///< frames in the queue or being encoded
  Clock::time_point oldest;         ///< when the first of them was taken
  std::optional<Clock::time_point> encoding_since;
  std::chrono::duration<double> each{};  ///< that a frame takes to encode and write, as seen lately
  std::deque<StampRow> rows;             ///< of recorded frames whose row is not written yet
  uint64_t next_sequence = 0;            ///< smallest that record() takes
  uint64_t measured_up_to = 0;           ///< sequence after the last measured one
  bool closing = false, closed = false, rows_failed = false;
  SessionStatus status;
  std::thread encoder, syncer;

  Impl(const fs::path& to, const SessionInfo& given, const SessionOptions& wanted)
      : folder(fresh_folder(to)),
        info(checked(given)),
        options(wanted),
        most_queued(std::max<size_t>(2, wanted.queue_bytes / info.format.frame_bytes())),
        video(SessionVideoWriter::create(folder / kSessionFrames, info.format, info.rate_Hz,
                                         to_text(info, {}, start))) {
    status.written_bytes = video->bytes();
    try {
      if (info.background) write_background(folder / kSessionBackground, *info.background);
      rows_file.emplace(folder / kSessionRows);
      rows_file->append(row_header());
      rows_file->sync();
      each = std::chrono::duration<double>(video->rehearse());
      write_text(folder, to_text(info, {}, start));
    } catch (const Error&) {
      // A session that cannot begin leaves no files that would make the next attempt fail.
      std::error_code ignored;
      for (const char* name : {kSessionFrames, kSessionBackground, kSessionRows})
        fs::remove(folder / name, ignored);
      throw;
    }
  }

  bool full() const;
  void stop(const std::string& why);
  bool admit(const Frame& frame, std::unique_lock<std::mutex>& lock);
  void encode_next(std::unique_lock<std::mutex>& lock);
  void write_rows(std::unique_lock<std::mutex>& lock, bool all);
  void run_encoder();
  void run_syncer();
  void finish();
};

/// Accepts no more frames; called with the lock held. Waiting frames are still written, where possible.
void SessionWriter::Impl::stop(const std::string& why) {
  if (status.error.empty()) status.error = why;
  room.notify_all();
}

/// No memory, or a frame would wait so long for its turn that a crash could cost more than is promised.
bool SessionWriter::Impl::full() const {
  if (held < 2) return false;
  if (held >= most_queued) return true;
  const Clock::time_point now = Clock::now();
  const std::chrono::duration<double> waited = now - oldest,
                                      encoding = encoding_since ? now - *encoding_since : each;
  const double behind_s = static_cast<double>(held) * std::max(each, encoding).count();
  return std::max(waited.count(), behind_s) > options.most_behind_s;
}

/// True when there is room and nothing speaks against recording; waits for it with no_drop.
bool SessionWriter::Impl::admit(const Frame& frame, std::unique_lock<std::mutex>& lock) {
  if (closing || !status.error.empty()) return false;
  if (frame.format != info.format) {
    stop("frames changed their format while recording");
    return false;
  }
  if (frame.sequence < next_sequence) {
    stop("frame " + std::to_string(frame.sequence) + " came after frame " +
         std::to_string(next_sequence - 1) + ": a recording takes rising numbers only");
    return false;
  }
  while (full()) {
    if (!options.no_drop) return false;
    room.wait_for(lock, kAskEvery);
    if (closing || !status.error.empty()) return false;
    if (full() && cancelled) {
      lock.unlock();
      const bool give_up = cancelled();
      lock.lock();
      if (give_up) return false;
    }
  }
  return true;
}

/// Takes the oldest frame to the video, without the lock while that lasts.
void SessionWriter::Impl::encode_next(std::unique_lock<std::mutex>& lock) {
  FramePointer frame = std::move(queue.front().frame);
  oldest = queue.front().since;
  queue.pop_front();
  const Clock::time_point begun = Clock::now();
  encoding_since = begun;
  lock.unlock();
  std::string error;
  try {
    const TraceSpan span("encode");
    video->write(*frame);
  } catch (const std::exception& e) {
    error = e.what();
  }
  lock.lock();
  --held;
  encoding_since.reset();
  const std::chrono::duration<double> took = Clock::now() - begun;
  each += (took > each ? 0.5 : 0.125) * (took - each);  // slower is believed sooner than faster
  if (!queue.empty()) oldest = queue.front().since;
  status.written_bytes = video->bytes();
  if (error.empty()) {
    ++status.written;
    const auto row = std::lower_bound(rows.begin(), rows.end(), frame->sequence,
                                      [](const StampRow& r, uint64_t n) { return r.stamp.sequence < n; });
    if (row != rows.end() && row->stamp.sequence == frame->sequence) row->in_video = true;
  } else {
    held -= queue.size();
    queue.clear();
    stop(error);
  }
  spare.push_back(std::move(frame));
  room.notify_one();
}

/// Rows of frames that are in the video and measured, or never will be; in order.
void SessionWriter::Impl::write_rows(std::unique_lock<std::mutex>& lock, bool all) {
  std::string lines;
  while (!rows.empty() && !rows_failed) {
    const StampRow& row = rows.front();
    const bool settled = all || info.outputs.empty() || row.cells || row.stamp.sequence < measured_up_to;
    if (!row.in_video || !settled) break;
    if (!lines.empty()) lines += '\n';
    lines += row_text(row);
    rows.pop_front();
  }
  if (lines.empty()) return;
  lock.unlock();
  std::string error;
  try {
    rows_file->append(lines);
  } catch (const std::exception& e) {
    error = e.what();
  }
  lock.lock();
  if (error.empty()) return;
  rows_failed = true;
  stop(error);
}

void SessionWriter::Impl::run_encoder() {
  name_trace_thread("record");
  std::unique_lock lock(mutex);
  while (true) {
    work.wait_for(lock, kRowsEvery, [&] { return closing || !queue.empty(); });
    if (!queue.empty()) encode_next(lock);
    write_rows(lock, false);
    if (closing && queue.empty()) break;
  }
  write_rows(lock, true);
}

void SessionWriter::Impl::run_syncer() {
  std::unique_lock lock(mutex);
  while (!end_sync.wait_for(lock, kSyncEvery, [&] { return closed; })) {
    lock.unlock();
    std::string error;
    try {
      video->sync();
      rows_file->sync();
    } catch (const std::exception& e) {
      error = e.what();
    }
    lock.lock();
    if (!error.empty()) stop(error);
  }
}

/// Index, last rows and the final word; the threads are gone.
void SessionWriter::Impl::finish() {
  std::unique_lock lock(mutex);
  SessionStatus last = status;
  lock.unlock();
  const auto attempt = [&](auto&& action) {
    try {
      action();
    } catch (const std::exception& e) {
      if (last.error.empty()) last.error = e.what();
    }
  };
  attempt([&] { video->finish(); });
  last.written_bytes = video->bytes();
  attempt([&] { rows_file->close(); });
  attempt([&] {
    SessionEnd end;
    end.complete = last.error.empty();
    end.frames = last.written;
    end.dropped = last.dropped;
    end.measured = last.measured;
    end.unmatched = last.unmatched;
    end.video_bytes = last.written_bytes;
    end.ended_by = last.error;
    end.clock = wall_clock();
    write_text(folder, to_text(info, end, start));
  });
  lock.lock();
  status = last;
}

SessionWriter::SessionWriter(const fs::path& folder, const SessionInfo& info, SessionOptions options)
    : impl_(std::make_unique<Impl>(folder, info, options)) {
  impl_->encoder = std::thread([this] { impl_->run_encoder(); });
  impl_->syncer = std::thread([this] { impl_->run_syncer(); });
}

SessionWriter::~SessionWriter() {
  close();
}

void SessionWriter::watch(std::function<bool()> cancelled) {
  impl_->cancelled = std::move(cancelled);
}

bool SessionWriter::record(const Frame& frame) {
  Impl& m = *impl_;
  std::unique_lock lock(m.mutex);
  if (!m.admit(frame, lock)) {
    ++m.status.dropped;
    return false;
  }
  FramePointer copy;
  if (!m.spare.empty()) {
    copy = std::move(m.spare.back());
    m.spare.pop_back();
  }
  const Clock::time_point taken = Clock::now();
  if (m.held++ == 0) m.oldest = taken;
  lock.unlock();
  bool copied = true;
  try {
    if (!copy) copy = std::make_unique<Frame>();
    copy->reshape(frame.format);
    std::memcpy(copy->bytes.data(), frame.pixels(), frame.format.frame_bytes());
    put_stamp(stamp_of(frame), *copy);
  } catch (const std::bad_alloc&) {
    copied = false;
  }
  lock.lock();
  if (!copied || m.closing || !m.status.error.empty()) {
    --m.held;
    ++m.status.dropped;
    return false;
  }
  m.next_sequence = frame.sequence + 1;
  m.rows.push_back({.stamp = stamp_of(frame), .cells = std::nullopt});
  m.queue.push_back({std::move(copy), taken});
  if (m.status.recorded++ == 0) m.status.first_frame = frame.sequence;
  m.status.last_frame = frame.sequence;
  m.work.notify_one();
  return true;
}

void SessionWriter::measured(const Touch& touch, int64_t ready_ns) {
  Impl& m = *impl_;
  std::string cells = Measurements::cells(touch, m.info.outputs);
  const std::lock_guard lock(m.mutex);
  if (m.closing) return;
  const auto row = std::lower_bound(m.rows.begin(), m.rows.end(), touch.sequence,
                                    [](const StampRow& r, uint64_t n) { return r.stamp.sequence < n; });
  if (row != m.rows.end() && row->stamp.sequence == touch.sequence && !row->cells) {
    row->cells = std::move(cells);
    row->measured_ns = ready_ns;
    ++m.status.measured;
  } else {
    ++m.status.unmatched;
  }
  m.measured_up_to = std::max(m.measured_up_to, touch.sequence + 1);
}

SessionStatus SessionWriter::status() const {
  const std::lock_guard lock(impl_->mutex);
  SessionStatus status = impl_->status;
  status.queued = impl_->held;
  status.queue_bytes = impl_->held * impl_->info.format.frame_bytes();
  if (impl_->held > 0) status.behind_s = std::chrono::duration<double>(Clock::now() - impl_->oldest).count();
  return status;
}

SessionStatus SessionWriter::close() {
  Impl& m = *impl_;
  if (m.encoder.joinable()) {
    {
      const std::lock_guard lock(m.mutex);
      m.closing = true;
    }
    m.work.notify_all();
    m.room.notify_all();
    m.encoder.join();
    {
      const std::lock_guard lock(m.mutex);
      m.closed = true;
    }
    m.end_sync.notify_all();
    m.syncer.join();
    m.finish();
  }
  return status();
}

}  // namespace palpate
