// Flaws of a pad: thin or small places where it no longer looks as in its untouched image, since a scratch,
// dust or a hair came after that, or an old one went.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/measure/picture/light_change.h"
#include "palpate/frame.h"
#include "palpate/touch.h"

namespace palpate {

struct FlawSummary {
  uint64_t px = 0;      ///< with a rim
  uint32_t places = 0;  ///< that do not touch each other
  PixelRect largest{};  ///< around the one of most pixels

  /// Sentence for people, without a full stop; empty: there are none.
  std::string describe() const;
};

/// A flaw differs from what is around it, once one light is taken out, by kClear_gray and more than the
/// picture's noise, is at most a fortieth of the picture wide, and stays. Where frames follow each other, the
/// first ones show it: it is in all of up to kLooks from the first on, in none of which anything else has
/// changed. A flaw that a later frame no longer shows is none any more (a thin object that was pressed from
/// the first frame on). Separate pictures may all be touched: a flaw is in kShare of those, kFewest at least,
/// in which its surroundings are untouched, and alike in them.
///
/// Runs on the host, frames in order.
class PadFlaws {
 public:
  static constexpr double kClear_gray = 8, kSteady_gray = 6;  ///< of one frame alone, of several pictures
  static constexpr double kSigmas = 7;                        ///< over noise
  static constexpr double kCalm_gray = 2.5;   ///< change of a place, without its flaws, that is no touch
  static constexpr double kUntouched = 0.98;  ///< of an untouched frame is calm
  static constexpr double kMost = 0.03;       ///< of the picture: more is another pad, or out of place
  static constexpr uint32_t kLooks = 4, kAgain = 32;  ///< frames; from one look for what went to the next
  static constexpr uint32_t kFewest = 3;
  static constexpr double kShare = 0.7;

  /// Frames of 8 bits. `separate`: they do not follow each other.
  PadFlaws(const FrameFormat& format, bool separate);

  void set_background(const Frame& untouched);
  /// Whether look_at() of the next frame compares it; else it counts it only.
  bool compares_next() const { return separate_ || !settled_ || (!sure_.empty() && frames_ % kAgain == 0); }
  /// Returns whether flaws() is another than before.
  bool look_at(const Frame& frame);
  /// Not 0 on a flaw and its rim of 2 px, row by row; empty: there are none.
  const std::vector<uint8_t>& flaws() const { return flaws_; }
  FlawSummary summary() const;
  /// Whether frames so far could show one.
  bool judged() const { return judged_; }

 private:
  using Plane = std::vector<float>;
  bool compare(const Frame& frame);
  void take_light_out(const Frame& frame, uint32_t channel);
  void find_bands();
  void find_clear(double least_gray);
  void box_mean(const Plane& from, uint32_t reach, Plane& to);
  void keep_thin(std::vector<uint8_t>& mask) const;
  bool look_at_following();
  bool look_at_picture();
  bool set_flaws(std::vector<uint8_t> mask);

  FrameFormat format_;
  bool separate_;
  uint32_t wide_;              // px, of the widest flaw
  std::vector<Plane> rest_;    // gray of each channel
  std::vector<Plane> change_;  // of the frame, light taken out
  std::vector<Plane> even_;    // the same about a place, without what is clear
  Plane strength_;             // of the channel that differs most: signed, over its limit
  Plane fine_, scratch_, weight_, weighted_;
  std::vector<uint8_t> clear_;         // differs from around
  std::vector<uint8_t> calm_;          // its surroundings do not
  std::vector<uint8_t> flaws_, sure_;  // with rims, without
  uint64_t frames_ = 0;
  bool settled_ = false;  // nothing is added any more
  bool judged_ = false;
  Plane sum_, squares_;  // of separate pictures, where calm
  std::vector<uint16_t> seen_, shown_;
};

}  // namespace palpate
