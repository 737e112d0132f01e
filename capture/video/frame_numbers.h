// Numbers and times of a film's pictures, and which of them to doubt: from the packets that go into the
// decoder and the pictures that come out.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace palpate {

/// A stream's times, in ticks.
struct TickClock {
  double tick_s = 0;    ///< s in a tick
  double period_s = 0;  ///< mean time from picture to picture; 0: not known
};

/// Follows packets (in the file's order) and pictures (in the order in which they are shown).
///
/// A picture that never comes out of the decoder, or that it flags, is left out, and with it those that may
/// refer to it: all that are coded after it, up to the next key picture. What is left out still counts in the
/// numbers of the pictures after it. Pictures before the first key picture (a film cut without coding it
/// again) are no part of the film and have no number.
class FrameNumbers {
 public:
  static constexpr int64_t kNoTick = INT64_MIN;

  struct Packet {
    int64_t tick = kNoTick;   ///< when its picture is shown
    bool key = false;         ///< its picture refers to no other
    bool disposable = false;  ///< no other refers to its picture
    bool faulty = false;      ///< the container doubts it
  };
  struct Numbered {
    uint64_t index = 0;           ///< from 0 at the film's first picture
    std::optional<int64_t> tick;  ///< since that
    bool doubtful = false;
  };

  /// `intra_only`: no picture refers to another. `reorder_ticks`: by how much later a picture may be shown
  /// than one that is coded after it; 0: pictures are shown in the order in which they are coded.
  FrameNumbers(bool intra_only, int64_t reorder_ticks)
      : intra_only_(intra_only), reorder_ticks_(intra_only ? 0 : reorder_ticks) {}

  void sent(const Packet& packet);
  /// The decoder has refused a packet, or failed at one.
  void failed() { ++failures_; }
  /// A picture has come out. `tick`: when it is shown; `faulty`: the decoder doubts it.
  void shown(int64_t tick, bool key, bool faulty);
  /// No more come out: what is still expected is lost.
  void ended();

  /// Whether the oldest picture that has come out may be taken: all that are coded before it are out as well.
  bool ready() const;
  size_t waiting() const { return waiting_.size(); }
  /// The oldest picture that has come out.
  Numbered take();

  /// Pictures left out so far: doubtful ones that were taken, and those that never came out.
  uint64_t left_out() const { return left_out_ + lost_at_end_; }
  /// Lost pictures after the last one that came out.
  uint64_t lost_at_end() const { return lost_at_end_; }

 private:
  struct Expected : Packet {
    uint64_t order = 0;
  };
  struct Shown {
    int64_t tick = kNoTick;
    uint64_t order = 0;
    uint64_t lost_before = 0;
    bool faulty = false;
  };
  /// A place in the order of coding, and when it is shown.
  struct Place {
    uint64_t order = 0;
    int64_t tick = 0;
  };

  std::optional<Expected> expected_at(int64_t tick);
  uint64_t lose_before(const Shown& shown);
  bool doubtful(const Shown& shown) const;
  bool intra_only_;
  int64_t reorder_ticks_;
  bool timed_ = true;  ///< every packet has its tick
  uint64_t sent_ = 0;
  uint64_t failures_ = 0;
  std::optional<int64_t> first_key_tick_;
  std::optional<int64_t> zero_tick_;
  std::vector<Expected> expected_;  ///< packets whose pictures have not come out
  std::vector<Shown> waiting_;      ///< pictures that have, oldest first
  std::vector<Place> keys_, faults_;
  bool doubting_ = false;  ///< without ticks: since a fault, until a key picture
  uint64_t next_ = 0, left_out_ = 0, lost_at_end_ = 0;
};

/// Times of a film's pictures, less the first one's: they rise from picture to picture.
///
/// A picture whose stamp does not rise above the one before it is placed one mean period after it; where
/// stamps jump back by more than a second (films joined into one), those after it go on from there.
class RisingTimes {
 public:
  explicit RisingTimes(const TickClock& clock) : clock_(clock) {}
  /// In order. `tick` since the first picture's; none: the stream has no times.
  int64_t next_ns(std::optional<int64_t> tick, uint64_t index);
  /// Pictures that were placed, as said above.
  uint64_t placed() const { return placed_; }

 private:
  TickClock clock_;
  std::optional<int64_t> last_ns_;
  int64_t offset_ns_ = 0;
  uint64_t placed_ = 0;
};

}  // namespace palpate
