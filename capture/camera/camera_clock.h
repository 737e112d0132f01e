// Sequence numbers and times of a camera's frames, made to go on where drivers start again, and on the host's
// clock.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace palpate {

/// A driver's 32-bit numbers as ones that never turn back.
class SequenceCounter {
 public:
  struct Step {
    uint64_t sequence;  ///< from 0 at the first frame
    uint64_t lost;      ///< numbers passed over since the one before
  };
  Step next(uint32_t raw) {
    if (fresh_) {
      fresh_ = false;
      raw_ = raw;
      return {sequence_, 0};
    }
    // A number that does not grow comes from a driver that does not count.
    const uint32_t ahead = raw - raw_;
    const uint64_t step = ahead == 0 || ahead > UINT32_MAX / 2 ? 1 : ahead;
    raw_ = raw;
    sequence_ += step;
    return {sequence_, step - 1};
  }
  /// The driver counts anew: the next frame has the number that the time passed makes it.
  void restart(double passed_s, double rate_Hz) {
    if (fresh_) return;
    const double frames = std::round(passed_s * rate_Hz);
    sequence_ += static_cast<uint64_t>(std::clamp(frames, 1.0, 1e12));
    fresh_ = true;
  }

 private:
  bool fresh_ = true;
  uint32_t raw_ = 0;
  uint64_t sequence_ = 0;
};

/// Times of exposure from a driver's stamps, or from the time of delivery where these cannot be right.
class FrameClock {
 public:
  struct Times {
    int64_t time_ns;     ///< grows from frame to frame, 0 at the first
    int64_t exposed_ns;  ///< CLOCK_MONOTONIC; 0: not known
  };
  /// `monotonic`: the driver says that its stamp is of CLOCK_MONOTONIC. One after the delivery, or more than
  /// kOldest_ns before it, is not believed.
  Times next(int64_t stamp_ns, bool monotonic, int64_t delivered_ns) {
    const bool believed = monotonic && stamp_ns <= delivered_ns && stamp_ns > delivered_ns - kOldest_ns;
    if (believed) {
      lag_ns_ = delivered_ns - stamp_ns;
      ++believed_;
    } else {
      ++refused_;
    }
    const int64_t now_ns = believed ? stamp_ns : delivered_ns - lag_ns_;
    if (believed_ + refused_ == 1) origin_ns_ = now_ns;
    last_ns_ = std::max(now_ns - origin_ns_, last_ns_ + 1);
    return {last_ns_, believed ? stamp_ns : 0};
  }
  uint64_t believed() const { return believed_; }
  uint64_t refused() const { return refused_; }

  static constexpr int64_t kOldest_ns = 10'000'000'000;

 private:
  int64_t origin_ns_ = 0;
  int64_t last_ns_ = -1;
  int64_t lag_ns_ = 0;
  uint64_t believed_ = 0;
  uint64_t refused_ = 0;
};

/// Stamps of a camera's own clock on the host's CLOCK_MONOTONIC: no frame arrives before it was taken, and
/// the one that came fastest shows how far the clocks are apart. What is left is the least time that a frame
/// needs on its way. A clock that goes back was set, or its camera began anew, and so does this.
class DeviceClock {
 public:
  /// Never after `delivered_ns`.
  int64_t on_host(int64_t stamp_ns, int64_t delivered_ns) {
    const int64_t apart_ns = delivered_ns - stamp_ns;
    if (!started_ || stamp_ns < last_stamp_ns_) {
      apart_ns_ = static_cast<double>(apart_ns);
    } else {
      // The clocks may drift apart: what was seen long ago counts less and less.
      const auto since_ns = static_cast<double>(std::max<int64_t>(0, delivered_ns - last_ns_));
      apart_ns_ = std::min(apart_ns_ + kDrift * since_ns, static_cast<double>(apart_ns));
    }
    started_ = true;
    last_ns_ = delivered_ns;
    last_stamp_ns_ = stamp_ns;
    return std::min(stamp_ns + static_cast<int64_t>(std::llround(apart_ns_)), delivered_ns);
  }

  static constexpr double kDrift = 100e-6;  ///< of two quartz clocks, more than they have

 private:
  bool started_ = false;
  double apart_ns_ = 0;
  int64_t last_ns_ = 0, last_stamp_ns_ = 0;
};

}  // namespace palpate
