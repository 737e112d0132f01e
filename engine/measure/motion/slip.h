// Slip, stick and incipient slip of one contact: Coulomb's limit, and whether anything moves.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace palpate {

/// Noise of a place, or of a number, from its second differences: what moves evenly has none.
class JitterNoise {
 public:
  void add(double x, double y);
  /// Standard deviation of one coordinate; `least` where that is more, twice that while too little was seen.
  double sd(double least) const;

 private:
  static constexpr size_t kKept = 31;
  std::array<double, kKept> bends_{};
  double x_[2] = {}, y_[2] = {};
  uint64_t count_ = 0;
};

/// A contact under friction in one frame.
struct FrictionState {
  double time_s = 0;
  double x_mm = 0, y_mm = 0;  ///< the contact
  /// The end of the pull's spring: moves only where the contact slides. Seen by the skin, or from the limit.
  double foot_x_mm = 0, foot_y_mm = 0;
  double error_mm = 0;  ///< standard error of these places
  bool limit_known = false;
  double limit_mm = 0;  ///< way that the spring gives before the contact slides
  bool foot_seen = false;
};

/// Watch over a contact: it slides where its foot moves by more than the noise; at the friction's limit
/// already where the contact moves on along its pull, or where the limit falls, as it does when a finger
/// lifts. It has stopped where nothing moves for longer than the way of that noise took before, or where the
/// load leaves the limit. All times are in seconds, and those of 1/30 s are averaged, so that
/// rates agree.
class SlipWatch {
 public:
  void restart();
  /// Frames in order.
  bool slides(const FrictionState& now);

 private:
  static constexpr size_t kAveraged = 32;
  /// What is compared with itself of some time ago.
  struct Places {
    double x_mm = 0, y_mm = 0, foot_x_mm = 0, foot_y_mm = 0, limit_mm = 0;
    double pull_mm() const;
  };
  Places mean_of_last(const FrictionState& now, double step_s);
  bool begins(const FrictionState& now, const Places& here, bool at_limit) const;
  bool goes_on(const FrictionState& now, const Places& here, bool at_limit, double step_s);

  uint64_t count_ = 0;
  std::array<Places, kAveraged> last_{};
  size_t averaged_ = 1;
  JitterNoise place_noise_, limit_noise_;
  Places before_;  // about 0.15 s ago, while it sticks
  Places mark_;    // while it slides: where it last had moved on by the noise
  double last_s_ = 0, mark_s_ = 0, pace_s_ = 0;
  double noise_mm_ = 0;              // of one frame
  double way_mm_ = 0, fall_mm_ = 0;  // motion of means that is more than their noise
  bool slides_ = false;
};

}  // namespace palpate
