// Slip, stick and incipient slip, from the motion of the skin relative to the contact.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "palpate/touch.h"

namespace palpate {

/// While a contact sticks, its centre moves with the skin under it; relative motion is sliding. It is
/// detected from the change of their distance within the last two and the last six frames, compared with the
/// noise of that distance, which is estimated from its second differences. Where the core sticks and the rim
/// does not, the slip is incipient.
class SlipWatch {
 public:
  explicit SlipWatch(double pitch_mm_per_px) : pitch_mm_per_px_(pitch_mm_per_px) {}

  void restart();
  /// Contact centre and the skin's motion in the same frame; nullopt while too few points are under the
  /// contact or too few frames have passed.
  std::optional<Slip> update(double x_mm, double y_mm, const SkinMotion& skin);
  /// How far contact and skin have moved apart since the last frame, mm.
  double apart_x_mm() const { return step_x_mm_; }
  double apart_y_mm() const { return step_y_mm_; }

 private:
  struct Place {
    double x_mm = 0, y_mm = 0;
  };
  static constexpr size_t kFrames = 7;
  static constexpr size_t kNoise = 31;
  const Place& ago(size_t frames) const { return places_[(count_ - 1 - frames) % kFrames]; }
  double noise_mm(double stated_mm) const;

  double pitch_mm_per_px_;
  std::array<Place, kFrames> places_{};
  uint64_t count_ = 0;
  std::array<double, kNoise> bends_{};  // size of second differences
  uint64_t bend_count_ = 0;
  double step_x_mm_ = 0, step_y_mm_ = 0;
};

}  // namespace palpate
