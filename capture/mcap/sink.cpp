#include "capture/mcap/sink.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "engine/base/clock.h"
#include "palpate/error.h"

namespace palpate {
namespace {

McapOptions with_clock(McapOptions options, int64_t error_ns) {
  options.facts["stamps"] = "time of exposure since 1970, by one offset from the host's monotonic clock";
  options.facts["clock_error_ns"] = std::to_string(error_ns);
  return options;
}

}  // namespace

McapSink::McapSink(const std::filesystem::path& folder, McapOptions options, McapSinkOptions how)
    : how_(std::move(how)),
      pitch_mm_per_px_(options.sensor.pitch_mm_per_px),
      begun_ns_(monotonic_ns()),
      file_(folder),
      recording_(file_, with_clock(std::move(options), clock_.error_ns)),
      writer_([this] { run(); }) {}

McapSink::~McapSink() {
  close();
}

/// False where the file has ended.
bool McapSink::make_room(size_t most) {
  std::unique_lock lock(mutex_);
  constexpr auto kAskEvery = std::chrono::milliseconds(50);
  while (how_.wait_unless && status_.error.empty() && queue_.size() >= most && !how_.wait_unless())
    room_.wait_for(lock, kAskEvery);
  if (!status_.error.empty()) {
    ++status_.dropped;
    return false;
  }
  while (queue_.size() >= most) {
    spare_.push_back(std::move(queue_.front()));
    queue_.pop_front();
    ++status_.dropped;
  }
  return true;
}

void McapSink::add(const Frame& frame, const Result& result) {
  const size_t each = frame.format.frame_bytes() + 4 * size_t{frame.format.width} * frame.format.height;
  if (!make_room(std::max<size_t>(2, how_.queue_bytes / each))) return;
  ItemPtr item;
  {
    const std::lock_guard lock(mutex_);
    if (!spare_.empty()) {
      item = std::move(spare_.back());
      spare_.pop_back();
    }
  }
  if (!item) item = std::make_unique<Item>();
  Frame& to = item->frame;
  to.reshape(frame.format);
  std::copy_n(frame.pixels(), frame.format.frame_bytes(), to.bytes.data());
  to.exposed_ns = frame.exposed_ns;
  item->touch = result.touch;
  item->depth_mm.clear();
  item->confidence.clear();
  if (const auto depth = depth_map_of(result, result.touch, frame.format, pitch_mm_per_px_)) {
    item->depth_mm.assign(depth->depth_mm.begin(), depth->depth_mm.end());
    item->confidence.assign(depth->confidence.begin(), depth->confidence.end());
  }
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(item));
  }
  work_.notify_one();
}

int64_t McapSink::stamp_of(const Item& item) const {
  if (item.frame.exposed_ns > 0) return clock_.ahead_ns + item.frame.exposed_ns;
  return clock_.ahead_ns + begun_ns_ + item.touch.time_ns;  // a recording that is played
}

void McapSink::write(const Item& item) {
  std::optional<DepthMap> depth;
  if (!item.depth_mm.empty())
    depth = DepthMap{item.depth_mm, item.confidence, item.frame.format.width, item.frame.format.height,
                     pitch_mm_per_px_};
  recording_.add(item.frame, item.touch, depth, stamp_of(item));
}

void McapSink::run() {
  constexpr int64_t kSync_ns = 400'000'000;
  int64_t synced_ns = monotonic_ns();
  std::unique_lock lock(mutex_);
  while (true) {
    work_.wait(lock, [this] { return closing_ || !queue_.empty(); });
    if (queue_.empty()) return;
    ItemPtr item = std::move(queue_.front());
    queue_.pop_front();
    room_.notify_one();
    if (!status_.error.empty()) {
      ++status_.dropped;
      continue;
    }
    lock.unlock();
    std::string error;
    try {
      write(*item);
      if (monotonic_ns() - synced_ns > kSync_ns) {
        file_.sync();
        synced_ns = monotonic_ns();
      }
    } catch (const Error& failed) {
      error = failed.what();
    }
    lock.lock();
    (error.empty() ? status_.written : status_.dropped) += 1;
    status_.error = error;
    status_.bytes = file_.counts().bytes;
    spare_.push_back(std::move(item));
  }
}

McapStatus McapSink::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

McapStatus McapSink::close() {
  {
    const std::lock_guard lock(mutex_);
    if (closing_) return status_;
    closing_ = true;
  }
  work_.notify_one();
  writer_.join();
  if (!status_.error.empty()) return status_;
  try {
    file_.close();
  } catch (const Error& failed) {
    status_.error = failed.what();
  }
  status_.bytes = file_.counts().bytes;
  return status_;
}

}  // namespace palpate
