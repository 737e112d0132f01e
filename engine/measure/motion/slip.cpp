#include "engine/measure/motion/slip.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace palpate {
namespace {

constexpr double kMean_s = 1.0 / 30;       // frames closer than that are averaged
constexpr double kSlipMemory_s = 0.15;     // slower motion than the noise in that time is none
constexpr double kUsualStep_s = 1.0 / 30;  // of frames without times
constexpr double kLongestStep_s = 0.5;     // after a longer one nothing is known of the motion before
constexpr double kPlaceFactor = 2.5 * std::numbers::sqrt2;  // of a place's noise, in the difference of two
constexpr double kLimitFactor = 4 * std::numbers::sqrt2;
constexpr double kLimitNoise = 0.2;  // least noise of the limit, over that of places
constexpr double kAlong = 1.3;       // of that, along the pull: noise at the limit seldom passes it
constexpr double kUnexpected = 1.5;  // a foot that moves below the limit moves by so much more
constexpr double kNearSeen = 0.06;   // of the limit: stiffness and skin err by as much
constexpr double kNearNoise = 2;
constexpr double kLeastLoad = 0.7;  // nothing slides below: there it rolls, or its outline changes
constexpr double kSlack = 0.1, kSlackSeen = 0.2;  // of the limit, below it: nothing slides any more
constexpr double kSlackNoise = 4;
constexpr double kFirstPace_s = 0.03;
constexpr double kStopPatience = 1.5;

}  // namespace

void JitterNoise::add(double x, double y) {
  if (count_ >= 2) bends_[(count_ - 2) % kKept] = std::hypot(x - 2 * x_[0] + x_[1], y - 2 * y_[0] + y_[1]);
  x_[1] = std::exchange(x_[0], x);
  y_[1] = std::exchange(y_[0], y);
  ++count_;
}

double JitterNoise::sd(double least) const {
  const size_t known = std::min<uint64_t>(count_ < 2 ? 0 : count_ - 2, kKept);
  if (known < 5) return 2 * least;
  std::array<double, kKept> sorted = bends_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(known / 2);
  std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(known));
  // The median length of a vector with two components of variance 6 s^2 is 1.18 sqrt(6) s.
  return std::max(least, *middle / (1.177 * std::sqrt(6.0)));
}

void SlipWatch::restart() {
  *this = {};
}

SlipWatch::Places SlipWatch::mean_of_last(const FrictionState& now, double step_s) {
  last_[count_ % kAveraged] = {now.x_mm, now.y_mm, now.foot_x_mm, now.foot_y_mm, now.limit_mm};
  averaged_ = std::clamp<size_t>(static_cast<size_t>(std::lround(kMean_s / step_s)), 1, kAveraged);
  averaged_ = std::min<size_t>(averaged_, count_ + 1);
  Places mean;
  for (size_t i = 0; i < averaged_; ++i) {
    const Places& p = last_[(count_ - i) % kAveraged];
    mean.x_mm += p.x_mm / static_cast<double>(averaged_);
    mean.y_mm += p.y_mm / static_cast<double>(averaged_);
    mean.foot_x_mm += p.foot_x_mm / static_cast<double>(averaged_);
    mean.foot_y_mm += p.foot_y_mm / static_cast<double>(averaged_);
    mean.limit_mm += p.limit_mm / static_cast<double>(averaged_);
  }
  return mean;
}

double SlipWatch::Places::pull_mm() const {
  return std::hypot(x_mm - foot_x_mm, y_mm - foot_y_mm);
}

bool SlipWatch::begins(const FrictionState& now, const Places& here, bool at_limit) const {
  const double pull_x = here.x_mm - here.foot_x_mm, pull_y = here.y_mm - here.foot_y_mm,
               pull = std::max(std::hypot(pull_x, pull_y), 1e-9);
  const double along = ((here.x_mm - before_.x_mm) * pull_x + (here.y_mm - before_.y_mm) * pull_y) / pull;
  if (at_limit && (along > kAlong * way_mm_ || before_.limit_mm - here.limit_mm > fall_mm_)) return true;
  const double dragged_mm =
      std::hypot(here.foot_x_mm - before_.foot_x_mm, here.foot_y_mm - before_.foot_y_mm);
  const bool may = !now.foot_seen || !now.limit_known || here.pull_mm() > kLeastLoad * here.limit_mm;
  return may && dragged_mm > kUnexpected * way_mm_;
}

bool SlipWatch::goes_on(const FrictionState& now, const Places& here, bool at_limit, double step_s) {
  const double slack_mm = here.limit_mm - here.pull_mm();
  if (now.limit_known &&
      slack_mm > std::max((now.foot_seen ? kSlackSeen : kSlack) * here.limit_mm, kSlackNoise * noise_mm_))
    return false;
  const double way_mm = std::hypot(here.foot_x_mm - mark_.foot_x_mm, here.foot_y_mm - mark_.foot_y_mm),
               fall_mm = at_limit ? mark_.limit_mm - here.limit_mm : 0, passed_s = now.time_s - mark_s_;
  if (const double moved = std::max(way_mm / way_mm_, fall_mm / fall_mm_); moved >= 1) {
    pace_s_ = std::min(passed_s / moved, kSlipMemory_s);
    mark_ = here;
    mark_s_ = now.time_s;
    return true;
  }
  return passed_s <= std::min(std::max(kStopPatience * pace_s_, 1.01 * step_s), kSlipMemory_s);
}

bool SlipWatch::slides(const FrictionState& given) {
  FrictionState now = given;
  if (count_ > 0 && now.time_s - last_s_ > kLongestStep_s) restart();
  if (count_ > 0 && now.time_s <= last_s_) now.time_s = last_s_ + kUsualStep_s;
  const double step_s = count_ > 0 ? now.time_s - last_s_ : kUsualStep_s;
  const Places here = mean_of_last(now, step_s);
  if (now.foot_seen)
    place_noise_.add(now.foot_x_mm, now.foot_y_mm);
  else
    place_noise_.add(now.x_mm, now.y_mm);
  limit_noise_.add(now.limit_mm, 0);
  const double averaged = std::sqrt(static_cast<double>(averaged_));
  noise_mm_ = place_noise_.sd(now.error_mm);
  way_mm_ = kPlaceFactor * noise_mm_ / averaged;
  // One coordinate's median is 0.67 standard deviations where two coordinates' is 1.18.
  fall_mm_ =
      kLimitFactor * std::max(limit_noise_.sd(0) * 1.177 / 0.6745, kLimitNoise * now.error_mm) / averaged;
  // An unseen foot is dragged along by noise until only the largest noise reaches the limit.
  const double near_mm = now.foot_seen ? kNearSeen * here.limit_mm : kNearNoise * noise_mm_;
  const bool at_limit = now.limit_known && here.pull_mm() >= here.limit_mm - near_mm;
  const bool slid = slides_;
  if (count_ == 0) {
    before_ = here;
  } else {
    slides_ = slid ? goes_on(now, here, at_limit, step_s) : begins(now, here, at_limit);
  }
  if (slides_ && !slid) {
    mark_ = here;
    mark_s_ = now.time_s;
    pace_s_ = kFirstPace_s;
  } else if (slid && !slides_) {
    before_ = here;
  } else if (!slides_) {
    const double news = std::min(1.0, step_s / kSlipMemory_s);
    const auto follow = [news](double& old, double is) { old += news * (is - old); };
    follow(before_.x_mm, here.x_mm);
    follow(before_.y_mm, here.y_mm);
    follow(before_.foot_x_mm, here.foot_x_mm);
    follow(before_.foot_y_mm, here.foot_y_mm);
    follow(before_.limit_mm, here.limit_mm);
  }
  last_s_ = now.time_s;
  ++count_;
  return slides_;
}

}  // namespace palpate
