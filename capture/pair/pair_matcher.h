// Matcher of two streams of frames by their times: which frame of one finger belongs to which of the other.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace palpate {

/// One of two fingers, as their gripper names them.
enum class Side : uint8_t { Left, Right };
inline constexpr std::array kSides = {Side::Left, Side::Right};
constexpr const char* to_string(Side side) {
  return side == Side::Left ? "left" : "right";
}
constexpr size_t index(Side side) {
  return static_cast<size_t>(side);
}
constexpr Side other(Side side) {
  return side == Side::Left ? Side::Right : Side::Left;
}

/// Two frames that were taken together, or one alone.
template <typename Item>
struct Matched {
  std::array<std::optional<Item>, 2> of;  ///< by index(Side)
  int64_t skew_ns = 0;                    ///< time of the right one less that of the left; 0 without both

  const std::optional<Item>& left() const { return of[0]; }
  const std::optional<Item>& right() const { return of[1]; }
  bool both() const { return of[0] && of[1]; }
};

/// Skew of all pairs so far.
class SkewStatistics {
 public:
  void add(int64_t skew_ns) {
    const double x = static_cast<double>(skew_ns), from = x - mean_ns_;
    mean_ns_ += from / static_cast<double>(++count_);
    squares_ += from * (x - mean_ns_);
  }
  uint64_t pairs() const { return count_; }
  double mean_ms() const { return 1e-6 * mean_ns_; }
  /// Of single pairs; 0 for fewer than two.
  double sd_ms() const {
    return count_ < 2 ? 0 : 1e-6 * std::sqrt(squares_ / static_cast<double>(count_ - 1));
  }

 private:
  uint64_t count_ = 0;
  double mean_ns_ = 0, squares_ = 0;
};

/// Pairs frames that are each other's nearest and at most `window_ns` apart; each frame comes out once, in
/// its side's order, alone where it has no partner. The answer depends on the times alone, not on which side
/// was faster, as long as no side falls behind by more than `most_waiting` frames: then frames go out alone.
/// One thread at a time.
template <typename Item>
class PairMatcher {
 public:
  using Out = std::vector<Matched<Item>>;

  PairMatcher(int64_t window_ns, size_t most_waiting) : window_ns_(window_ns), most_waiting_(most_waiting) {}

  /// A frame, and all that is decided with it. Times of a side rise; one that does not begins anew: what
  /// waits of that side goes out, alone where no partner waits for it.
  Out add(Side side, int64_t time_ns, Item item) {
    Out out;
    Queue& queue = waiting_[index(side)];
    absent_[index(side)] = false;
    if (!queue.empty() && time_ns <= queue.back().time_ns) {
      for (absent_[index(side)] = true; !queue.empty() && decide(out);) {
      }
      absent_[index(side)] = false;
      release_all(side, out);
    }
    queue.push_back({time_ns, std::move(item)});
    while (decide(out)) {
    }
    return out;
  }
  /// A side has ended or its camera is gone: nothing waits for it until its next frame.
  Out leave(Side side) {
    Out out;
    absent_[index(side)] = true;
    while (decide(out)) {
    }
    return out;
  }
  const SkewStatistics& skew() const { return skew_; }
  uint64_t alone(Side side) const { return alone_[index(side)]; }

 private:
  struct Waiting {
    int64_t time_ns;
    Item item;
  };
  using Queue = std::deque<Waiting>;

  void release(Side side, Out& out) {
    Queue& queue = waiting_[index(side)];
    Matched<Item> one;
    one.of[index(side)] = std::move(queue.front().item);
    queue.pop_front();
    ++alone_[index(side)];
    out.push_back(std::move(one));
  }
  void release_all(Side side, Out& out) {
    while (!waiting_[index(side)].empty()) release(side, out);
  }
  void pair(Out& out) {
    Queue &left = waiting_[0], &right = waiting_[1];
    Matched<Item> both;
    both.skew_ns = right.front().time_ns - left.front().time_ns;
    both.of = {std::move(left.front().item), std::move(right.front().item)};
    left.pop_front();
    right.pop_front();
    skew_.add(both.skew_ns);
    out.push_back(std::move(both));
  }

  /// Decides about the oldest frame; false: the next frame is needed first.
  bool decide(Out& out) {
    const bool no_left = waiting_[0].empty(), no_right = waiting_[1].empty();
    if (no_left && no_right) return false;
    if (no_left || no_right) {
      const Side here = no_left ? Side::Right : Side::Left;
      if (!absent_[index(other(here))] && waiting_[index(here)].size() <= most_waiting_) return false;
      release(here, out);
      return true;
    }
    const Side first = waiting_[0].front().time_ns <= waiting_[1].front().time_ns ? Side::Left : Side::Right;
    const Queue &earlier = waiting_[index(first)], &later = waiting_[index(other(first))];
    const int64_t apart_ns = later.front().time_ns - earlier.front().time_ns;
    // At once where they are close: no camera takes two frames within its half period.
    const bool close = 2 * apart_ns <= window_ns_, next_known = earlier.size() > 1;
    const bool next_nearer = next_known && std::abs(earlier[1].time_ns - later.front().time_ns) < apart_ns;
    if (apart_ns > window_ns_ || (!close && next_nearer))
      release(first, out);
    else if (close || next_known || absent_[index(first)] || later.size() > most_waiting_)
      pair(out);
    else
      return false;
    return true;
  }

  int64_t window_ns_;
  size_t most_waiting_;
  std::array<Queue, 2> waiting_;
  std::array<bool, 2> absent_{};
  std::array<uint64_t, 2> alone_{};
  SkewStatistics skew_;
};

}  // namespace palpate
