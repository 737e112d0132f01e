#include "capture/video/frame_numbers.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

/// Packets that a decoder may hold back to bring pictures into the order in which they are shown.
constexpr uint64_t kMostReordered = 32;
constexpr size_t kMostWaiting = 40;
constexpr size_t kMostKeys = 64;
constexpr int64_t kSecond_ns = 1'000'000'000;

}  // namespace

void FrameNumbers::sent(const Packet& packet) {
  if (packet.tick == kNoTick) timed_ = false;
  const uint64_t order = sent_++;
  if (!timed_) return;
  if (packet.key || intra_only_) {
    if (!first_key_tick_) first_key_tick_ = packet.tick;
    keys_.push_back({order, packet.tick});
    if (keys_.size() > kMostKeys) {
      keys_.erase(keys_.begin());
      std::erase_if(faults_, [&](const Place& fault) { return fault.order < keys_.front().order; });
    }
  }
  Expected expected;
  static_cast<Packet&>(expected) = packet;
  expected.order = order;
  expected_.push_back(expected);
}

std::optional<FrameNumbers::Expected> FrameNumbers::expected_at(int64_t tick) {
  const auto at = std::find_if(expected_.begin(), expected_.end(),
                               [&](const Expected& expected) { return expected.tick == tick; });
  if (at == expected_.end()) return std::nullopt;
  const Expected found = *at;
  expected_.erase(at);
  return found;
}

/// Pictures that should have been shown before this one. Returns how many have a number.
uint64_t FrameNumbers::lose_before(const Shown& shown) {
  uint64_t counted = 0;
  std::erase_if(expected_, [&](const Expected& expected) {
    const bool before = expected.order < shown.order;
    // Where stamps jump back, what is coded later only seems to be shown earlier.
    const bool overdue =
        expected.tick < shown.tick && (before || (expected.order - shown.order <= kMostReordered &&
                                                  shown.tick - expected.tick < reorder_ticks_));
    const bool forgotten = before && shown.order - expected.order > 2 * kMostReordered;
    if (!overdue && !forgotten) return false;
    if (zero_tick_ && expected.tick >= *zero_tick_) ++counted;
    if (!expected.disposable && !intra_only_) faults_.push_back({expected.order, expected.tick});
    return true;
  });
  return counted;
}

void FrameNumbers::shown(int64_t tick, bool key, bool faulty) {
  Shown picture{.tick = tick, .order = sent_, .faulty = faulty};
  const std::optional<Expected> expected = timed_ ? expected_at(tick) : std::nullopt;
  if (expected) {
    picture.order = expected->order;
    picture.faulty = faulty || expected->faulty;
    if (!zero_tick_) zero_tick_ = std::min(tick, first_key_tick_.value_or(tick));
    picture.lost_before = lose_before(picture);
    if (picture.faulty && !expected->disposable && !intra_only_) faults_.push_back({picture.order, tick});
  } else {
    if (!zero_tick_ && tick != kNoTick) zero_tick_ = tick;
    picture.lost_before = failures_;
    if (!intra_only_ && (faulty || failures_ > 0)) doubting_ = true;
    if (key && !faulty) doubting_ = false;
    picture.faulty = faulty || doubting_;
  }
  failures_ = 0;
  waiting_.push_back(picture);
}

void FrameNumbers::ended() {
  uint64_t lost = timed_ ? 0 : failures_;
  for (const Expected& expected : expected_) {
    if (zero_tick_ && expected.tick >= *zero_tick_) ++lost;
    if (!expected.disposable && !intra_only_) faults_.push_back({expected.order, expected.tick});
  }
  expected_.clear();
  failures_ = 0;
  lost_at_end_ += lost;
}

bool FrameNumbers::ready() const {
  if (waiting_.empty()) return false;
  if (reorder_ticks_ == 0 || waiting_.size() >= kMostWaiting) return true;
  return std::none_of(expected_.begin(), expected_.end(),
                      [&](const Expected& expected) { return expected.order < waiting_.front().order; });
}

/// Whether a picture is coded after a fault, with no key picture between the two. A picture that is shown
/// before a key one and coded after it may refer to what lies before the key; no other refers to it, but such
/// as are shown before the key as well.
bool FrameNumbers::doubtful(const Shown& shown) const {
  if (shown.faulty) return true;
  Place since{0, kNoTick};
  for (const Place& key : keys_)
    if (key.order <= shown.order && key.tick <= shown.tick && key.order >= since.order) since = key;
  return std::any_of(faults_.begin(), faults_.end(), [&](const Place& fault) {
    return fault.order >= since.order && fault.order <= shown.order && fault.tick >= since.tick;
  });
}

FrameNumbers::Numbered FrameNumbers::take() {
  const Shown picture = waiting_.front();
  waiting_.erase(waiting_.begin());
  next_ += picture.lost_before;
  left_out_ += picture.lost_before;
  Numbered numbered{next_++, std::nullopt, doubtful(picture)};
  if (picture.tick != kNoTick && zero_tick_) numbered.tick = picture.tick - *zero_tick_;
  left_out_ += numbered.doubtful;
  return numbered;
}

int64_t RisingTimes::next_ns(std::optional<int64_t> tick, uint64_t index) {
  if (!tick && clock_.period_s <= 0) return 0;
  const double stamp_s =
      tick ? static_cast<double>(*tick) * clock_.tick_s : static_cast<double>(index) * clock_.period_s;
  int64_t time_ns = std::llround(stamp_s * 1e9) + offset_ns_;
  if (last_ns_ && time_ns <= *last_ns_) {
    const int64_t placed_ns = *last_ns_ + std::max<int64_t>(1, std::llround(clock_.period_s * 1e9));
    if (*last_ns_ - time_ns > kSecond_ns) offset_ns_ += placed_ns - time_ns;
    time_ns = placed_ns;
    ++placed_;
  }
  last_ns_ = time_ns;
  return time_ns;
}

}  // namespace palpate
