// Cameras of one frame a simulated second, so that a day passes in minutes.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "capture/pair/pair_matcher.h"
#include "capture/source.h"
#include "engine/base/clock.h"

namespace palpate {

/// Simulated time: a second passes once both cameras' frames of it are measured. Five in a hundred are in a
/// hurry and do not wait for that, while the engines are busy, so that newer frames win. A frame that nobody
/// measures holds time up for a real second.
class SimulatedTime {
 public:
  /// A camera's thread, before its second `n`.
  void wait(Side side, uint64_t n, const std::function<bool()>& cancelled) {
    const size_t here = index(side), there = index(other(side));
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    std::unique_lock lock(mutex_);
    const auto due = [&] {
      const bool settled = measured_[here] >= given_[here] || in_hurry(n);
      return !held_ && passed_[there] >= n && (settled || std::chrono::steady_clock::now() > end);
    };
    while (!due() && !cancelled()) moved_.wait_for(lock, std::chrono::milliseconds(50));
  }
  /// A second of a camera is over, with a frame or without.
  void pass(Side side, uint64_t n, bool frame) {
    const std::lock_guard lock(mutex_);
    passed_[index(side)] = n + 1;
    if (frame) given_[index(side)] = n + 1;
    moved_.notify_all();
  }
  void measured(Side side, uint64_t n) {
    const std::lock_guard lock(mutex_);
    measured_[index(side)] = n + 1;
    moved_.notify_all();
  }
  /// An engine's thread, with its frame of second `n` of so many: before a hurry until that is over.
  void sit_out_hurry(Side side, uint64_t n, uint64_t seconds) {
    if (in_hurry(n) || !in_hurry(n + 1)) return;
    std::unique_lock lock(mutex_);
    moved_.wait(lock, [&] { return passed_[index(side)] >= std::min(n + 1 + kHurry, seconds); });
  }
  /// No second begins meanwhile.
  void hold(const std::function<void()>& work) {
    set_held(true);
    work();
    set_held(false);
  }
  uint64_t now_s() const {
    const std::lock_guard lock(mutex_);
    return std::min(passed_[0], passed_[1]);
  }

 private:
  static constexpr uint64_t kHurry = 5;
  static bool in_hurry(uint64_t n) { return n % 100 >= 1 && n % 100 <= kHurry; }
  void set_held(bool held) {
    const std::lock_guard lock(mutex_);
    held_ = held;
    moved_.notify_all();
  }

  mutable std::mutex mutex_;
  std::condition_variable moved_;
  bool held_ = false;
  std::array<uint64_t, 2> passed_{}, given_{}, measured_{};  ///< seconds, from 1
};

/// A simulated camera of one frame a simulated second, which loses its plug for a while now and then.
class SlowCamera : public Source {
 public:
  SlowCamera(Side side, const std::vector<Frame>& round, SimulatedTime& time, uint64_t seconds)
      : side_(side), round_(round), time_(time), seconds_(seconds) {}
  FrameFormat format() const override { return round_.front().format; }
  double rate_Hz() const override { return 1; }
  std::optional<uint64_t> frame_count() const override { return std::nullopt; }
  bool live() const override { return true; }
  CaptureCounts counts() const override { return {.lost = lost_, .damaged = 0, .gaps = gaps_}; }
  std::string state() const override { return away_ ? "camera unplugged; waiting" : ""; }
  void watch(const std::function<bool()>& cancelled) override { cancelled_ = cancelled; }
  bool next(Frame& frame) override {
    for (;; ++second_) {
      if (second_ == seconds_) return false;
      time_.wait(side_, second_, cancelled_);
      if (cancelled_()) return false;
      const bool away = second_ % 300 >= 290 && (second_ / 300) % 2 == index(side_);
      if (!away) break;
      ++lost_;
      away_ = true;
      time_.pass(side_, second_, false);
    }
    frame.reshape(format());
    frame.bytes = round_[second_ % round_.size()].bytes;
    frame.sequence = second_;
    frame.time_ns = static_cast<int64_t>(second_) * 1'000'000'000;
    // Of the right one 20 ms later, and somewhat uneven.
    const auto uneven_ns = static_cast<int64_t>(second_ * 7919 % 5'000'000);
    frame.exposed_ns = start_ns_ + frame.time_ns + (side_ == Side::Right ? 20'000'000 : 0) + uneven_ns;
    frame.delivered_ns = frame.exposed_ns + 5'000'000;
    frame.after_gap = away_.exchange(false);
    gaps_ += frame.after_gap ? 1 : 0;
    time_.pass(side_, second_++, true);
    return true;
  }

 private:
  static inline const int64_t start_ns_ = monotonic_ns();
  const Side side_;
  const std::vector<Frame>& round_;
  SimulatedTime& time_;
  const uint64_t seconds_;
  uint64_t second_ = 0;
  std::atomic<uint64_t> lost_{0}, gaps_{0};
  std::atomic<bool> away_{false};
  std::function<bool()> cancelled_ = [] { return false; };
};

}  // namespace palpate
