#include "engine/measure/motion/slip.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr uint32_t kLeastPoints = 5;
constexpr double kSure = 5;              // times the noise
constexpr double kLeastShort_px = 0.12;  // within two frames
constexpr double kLeastLong_px = 0.3;    // within six
constexpr double kRimSlips = 0.8;        // stick share below which the rim is said to slip
constexpr double kSlipCentroidError_px = 0.03;

}  // namespace

void SlipWatch::restart() {
  count_ = bend_count_ = 0;
  step_x_mm_ = step_y_mm_ = 0;
}

double SlipWatch::noise_mm(double stated_mm) const {
  const size_t known = std::min<uint64_t>(bend_count_, kNoise);
  if (known < 5) return stated_mm;
  std::array<double, kNoise> sorted = bends_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(known / 2);
  std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(known));
  // The median length of a vector with two components of variance 6 s^2 is 1.18 sqrt(6) s.
  return std::max(stated_mm, *middle / (1.177 * std::sqrt(6.0)));
}

std::optional<Slip> SlipWatch::update(double x_mm, double y_mm, const SkinMotion& skin) {
  if (skin.touching < kLeastPoints) {
    restart();
    return std::nullopt;
  }
  const Place here{x_mm - skin.shift_x_mm.value, y_mm - skin.shift_y_mm.value};
  places_[count_++ % kFrames] = here;
  if (count_ < 2) return std::nullopt;
  step_x_mm_ = here.x_mm - ago(1).x_mm;
  step_y_mm_ = here.y_mm - ago(1).y_mm;
  if (count_ < 3) return std::nullopt;
  const auto since = [&](size_t frames) {
    return std::hypot(here.x_mm - ago(frames).x_mm, here.y_mm - ago(frames).y_mm);
  };
  const double stated_mm =
      std::hypot(kSlipCentroidError_px * pitch_mm_per_px_, skin.shift_x_mm.standard_error);
  const double sure_mm = kSure * std::sqrt(2.0) * noise_mm(stated_mm);
  bends_[bend_count_++ % kNoise] =
      std::hypot(here.x_mm - 2 * ago(1).x_mm + ago(2).x_mm, here.y_mm - 2 * ago(1).y_mm + ago(2).y_mm);
  const double short_mm = std::max(kLeastShort_px * pitch_mm_per_px_, sure_mm),
               long_mm = std::max(kLeastLong_px * pitch_mm_per_px_, sure_mm);
  const bool slow = count_ >= kFrames && since(6) > long_mm && since(2) > long_mm / 3;
  if (since(2) > short_mm || slow) return Slip::Slip;
  const Estimate& fraction = skin.stick_share;
  const bool reported = fraction.validity == Validity::Valid || fraction.validity == Validity::OnsetUnseen;
  return reported && fraction.value + fraction.standard_error < kRimSlips ? Slip::Incipient : Slip::Stick;
}

}  // namespace palpate
